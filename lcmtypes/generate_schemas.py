#!/usr/bin/python3
"""Writes the layout of every message as a C++ table, from the .lcm files.

lcm-gen's decoders resize vectors by numbers that they have not checked. With this table,
common/message_check.h walks a datagram before it is decoded: sizes, counts, strings, finite floats.

usage: generate_schemas.py OUT.cc FILE.lcm...
"""
import re
import sys

PRIMITIVES = {"int8_t": ("kInt8", 1), "byte": ("kByte", 1), "boolean": ("kInt8", 1),
              "int16_t": ("kInt16", 2), "int32_t": ("kInt32", 4), "int64_t": ("kInt64", 8),
              "float": ("kFloat", 4), "double": ("kDouble", 8), "string": ("kString", 0)}


def parse(path):
    """(struct name, [(type, name, [dimension, ...])]) of one .lcm file."""
    text = re.sub(r"//[^\n]*|/\*.*?\*/", "", open(path, encoding="utf-8").read(), flags=re.S)
    struct = re.search(r"struct\s+(\w+)\s*\{(.*)\}", text, re.S)
    if not struct:
        sys.exit(f"{path}: no struct found")
    fields = []
    for statement in struct.group(2).split(";"):
        statement = statement.strip()
        if not statement or statement.startswith("const "):
            continue
        match = re.fullmatch(r"(\w+)\s+(\w+)((?:\s*\[\s*\w+\s*\])*)", statement)
        if not match:
            sys.exit(f"{path}: cannot read '{statement}'")
        fields.append((match[1], match[2], re.findall(r"\[\s*(\w+)\s*\]", match[3])))
    return struct.group(1), fields


def emit(structs):
    out = ["// Made by lcmtypes/generate_schemas.py: do not edit.",
           '#include "common/message_check.h"']
    out += [f"#include <foresight/{name}.hpp>" for name in structs]
    out += ["", "namespace foresight {", "namespace {", ""]
    for name in structs:
        out.append(f"extern const MessageSchema k_{name};")
    for name, fields in structs.items():
        names = [f[1] for f in fields]
        rows = []
        for type_name, field, dimensions in fields:
            kind, nested = ("kStruct", f"&k_{type_name}") if type_name in structs else (
                PRIMITIVES[type_name][0], "nullptr")
            dims = ", ".join(f"{{{d}, -1}}" if d.isdigit() else f"{{0, {names.index(d)}}}"
                             for d in dimensions)
            rows.append(f'    {{"{field}", FieldKind::{kind}, {nested}, {{{dims}}}}},')
        out += ["", f'const MessageSchema k_{name} = {{"{name}", {{'] + rows
        out += [f"}}, &{name}::getHash}};"]
    out += ["", "}  // namespace", "",
            "const MessageSchema* find_schema(std::string_view type_name) {"]
    out += [f'  if (type_name == "{n}") return &k_{n};' for n in structs]
    out += ["  return nullptr;", "}", "",
            "const std::vector<const MessageSchema*>& all_schemas() {",
            "  static const std::vector<const MessageSchema*> all = {"]
    out += [f"      &k_{n}," for n in structs] + ["  };", "  return all;", "}", "",
                                                  "}  // namespace foresight", ""]
    return "\n".join(out)


def main():
    if len(sys.argv) < 3:
        sys.exit(__doc__)
    structs = dict(parse(path) for path in sys.argv[2:])
    with open(sys.argv[1], "w", encoding="utf-8") as out:
        out.write(emit(structs))


if __name__ == "__main__":
    main()
