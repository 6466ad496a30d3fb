#include "common/kept_file.h"

#include <filesystem>
#include <fstream>
#include <iterator>
#include <sstream>
#include <system_error>
#include <vector>

#include "common/errors.h"
#include "common/fnv.h"
#include "common/output_file.h"

namespace foresight {
namespace {

namespace fs = std::filesystem;

constexpr const char* kHeader = "foresight_kept 1";
constexpr std::uintmax_t kLargest_bytes = 1 << 20;

struct Content {
  RunIdentity run;
  int reads = 0;
  std::string text;
};

uint64_t hash_of(const std::string& text) {
  Fnv1a hash;
  hash.add(text);
  return hash.value();
}

std::string to_text(const Content& c) {
  std::ostringstream body;
  body << c.run << "reads " << c.reads << "\n" << c.text;
  return std::string(kHeader) + "\nhash " + std::to_string(hash_of(body.str())) + "\n" + body.str();
}

// Nothing unless every byte is as it was written.
std::optional<Content> parse(const std::string& file) {
  std::istringstream in(file);
  std::string header, word;
  uint64_t hash = 0;  // compared with the rest of the text
  Content c;
  if (!std::getline(in, header)) return std::nullopt;
  in >> word >> hash >> c.run >> word >> c.reads;
  if (!in || in.get() != '\n') return std::nullopt;
  c.text.assign(std::istreambuf_iterator<char>(in), {});
  if (to_text(c) != file) return std::nullopt;  // the hash is part of it
  return c;
}

std::optional<Content> parse_file(const fs::path& path) {
  std::error_code error;
  const auto size = fs::file_size(path, error);
  if (error || size > kLargest_bytes) return std::nullopt;
  std::ifstream file(path, std::ios::binary);
  return parse({std::istreambuf_iterator<char>(file), {}});
}

// A name that --name may have set to anything, as part of a file's name.
std::string plain(std::string name) {
  for (char& c : name) {
    const bool is_plain = (c >= '0' && c <= '9') || (c >= 'A' && c <= 'Z') ||
                          (c >= 'a' && c <= 'z') || c == '_' || c == '-';
    if (!is_plain) c = '_';
  }
  return name.substr(0, 64);
}

}  // namespace

KeptFile::KeptFile(const std::string& folder, const std::string& name, const RunIdentity& run)
    : folder_(folder),
      prefix_("kept_" + plain(name) + "."),
      path_(folder + "/" + prefix_ + std::to_string(run.parent_pid)),
      run_(run) {}

std::optional<std::string> KeptFile::read(std::string* trouble) {
  trouble->clear();
  std::error_code error;
  if (!fs::exists(path_, error)) return std::nullopt;
  const auto content = parse_file(path_);
  if (!content) {
    *trouble = path_ + ": is damaged";
    return std::nullopt;
  }
  if (content->run != run_) return std::nullopt;
  if (content->reads >= kMostReads) {
    *trouble = path_ + ": " + std::to_string(kMostReads) + " have ended with it";
    return std::nullopt;
  }
  try {
    write(content->text, content->reads + 1);
  } catch (const UnavailableError& e) {  // it could end its readers for ever
    *trouble = e.what();
    return std::nullopt;
  }
  return content->text;
}

void KeptFile::write(std::string_view text, int reads) const {
  std::error_code error;
  fs::create_directories(folder_, error);
  replace_output(path_, to_text({run_, reads, std::string(text)}));
}

void KeptFile::write(std::string_view text) const { write(text, 0); }

void KeptFile::remove() const {
  std::error_code error;
  fs::remove(path_, error);
  fs::remove(path_ + ".part", error);  // of one that was killed while it wrote
}

void KeptFile::remove_those_of_ended_runs() const {
  std::error_code error;
  std::vector<fs::path> ended;
  for (const auto& entry : fs::directory_iterator(folder_, error)) {
    if (!entry.path().filename().string().starts_with(prefix_)) continue;
    const auto content = parse_file(entry.path());
    if (content && content->run != run_ && !goes_on(content->run)) ended.push_back(entry.path());
  }
  for (const fs::path& path : ended) fs::remove(path, error);
}

}  // namespace foresight
