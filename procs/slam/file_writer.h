// A file of text in which every number keeps its bits, in as few digits as that takes, or of bytes.
// Written at once when it is closed, so that a disk that fills up is noticed.
//
//   FileWriter file("poses.txt");
//   file.line("pose", 7, 0.1);              // words, a blank between them
//   file << "x " << 0.1 << "\n";
//   file.close();                           // throws UnavailableError
#pragma once

#include <array>
#include <charconv>
#include <filesystem>
#include <fstream>
#include <string>
#include <string_view>
#include <type_traits>

#include "common/errors.h"

namespace foresight {

class FileWriter {
 public:
  explicit FileWriter(const std::filesystem::path& path) : path_(path) {}

  template <class Word>
  FileWriter& operator<<(const Word& word) {
    if constexpr (std::is_same_v<Word, bool>) {
      text_ += word ? '1' : '0';
    } else if constexpr (std::is_arithmetic_v<Word> && !std::is_same_v<Word, char>) {
      std::array<char, 32> digits;
      text_.append(digits.data(), std::to_chars(digits.begin(), digits.end(), word).ptr);
    } else if constexpr (requires { word.is_valid(); }) {
      *this << word.value();  // an Id
    } else {
      text_ += word;
    }
    return *this;
  }
  template <class... Words>
  void line(const Words&... words) {
    const char* gap = "";
    ((*this << gap << words, gap = " "), ...);
    text_ += '\n';
  }
  void close() {
    std::ofstream file(path_, std::ios::binary);
    file.write(text_.data(), static_cast<std::streamsize>(text_.size()));
    file.close();
    if (!file) throw UnavailableError(path_.string() + ": cannot be written");
  }

 private:
  std::filesystem::path path_;
  std::string text_;
};

}  // namespace foresight
