#include "preprocess/volume/identity.h"

#include <array>
#include <cctype>
#include <cstddef>
#include <sstream>

namespace wireplan::preprocess {
namespace {

/// Day, month and year (DA, PS3.5 section 6.2: "19540321") as people order them.
std::vector<std::string> orders_of_date(const std::string& date) {
  const std::string year = date.substr(0, 4), month = date.substr(4, 2), day = date.substr(6, 2);
  std::vector<std::string> orders;
  for (const std::string& y : {year, year.substr(2)}) {
    orders.push_back(y + month + day);
    orders.push_back(day + month + y);
    orders.push_back(month + day + y);
  }
  return orders;
}

std::string only(const std::string& text, int (*kept)(int), char other) {
  std::string result;
  for (const char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    if (kept(byte) != 0 || byte >= 0x80) {
      result += static_cast<char>(std::tolower(byte));
    } else if (other != '\0') {
      result += other;
    }
  }
  return result;
}

/// In small letters, with one blank between and around them.
std::string words_of(const std::string& text) {
  std::string words = " ";
  std::istringstream parts(only(text, std::isalnum, ' '));
  for (std::string part; parts >> part;) words += part + " ";
  return words;
}

/// The month that a word names, in full or by its first three letters or more, as in "29 Feb 2024";
/// 0 where it names none.
int month_of(const std::string& word) {
  static const std::array<const char*, 12> kNames = {
      "january januar janvier enero gennaio janeiro jaenner",
      "february februar fevrier f\xc3\xa9vrier febrero febbraio fevereiro",
      "march maerz m\xc3\xa4rz mrz mars marzo marco",
      "april avril abril aprile",
      "may mai mayo maggio maio",
      "june juni juin junio giugno junho",
      "july juli juillet julio luglio julho",
      "august aout ao\xc3\xbbt agosto",
      "september septembre septiembre settembre setembro",
      "october oktober octobre octubre ottobre outubro",
      "november novembre noviembre novembro",
      "december dezember decembre d\xc3\xa9"
      "cembre diciembre dicembre dezembro"};
  constexpr std::size_t kLeast = 3;
  if (word.size() < kLeast) return 0;
  for (std::size_t month = 0; month < kNames.size(); ++month) {
    std::istringstream names(kNames[month]);
    for (std::string name; names >> name;) {
      if (name.starts_with(word)) return static_cast<int>(month) + 1;
    }
  }
  return 0;
}

/// The digits of a text, each number and each month's name with two digits at least: "2-Jan-2024"
/// has "02012024".
std::string digits_of_named_date(const std::string& text) {
  std::string parted;
  for (const char c : only(text, std::isalnum, ' ')) {  // letters and digits are words of their own
    const auto is_digit = [](char one) { return one >= '0' && one <= '9'; };
    if (!parted.empty() && is_digit(parted.back()) != is_digit(c)) parted += ' ';
    parted += c;
  }
  std::string digits;
  std::istringstream words(parted);
  for (std::string word; words >> word;) {
    const bool number = word[0] >= '0' && word[0] <= '9';
    const int month = number ? 0 : month_of(word);
    if (!number && month == 0) continue;
    const std::string found = number ? word : std::to_string(month);
    digits += (found.size() == 1 ? "0" : "") + found;
  }
  return digits;
}

/// Whether two letters that stand alone behind one another are the first ones of two words of the
/// tag. `words` are in small letters, with blanks between and around them.
bool holds_initials(const std::string& words, const std::string& tag) {
  std::string initials;
  std::istringstream parts(only(tag, std::isalpha, ' '));
  for (std::string part; parts >> part;) initials += part[0];
  for (std::size_t k = 0; k < initials.size(); ++k) {
    for (std::size_t n = 0; n < initials.size(); ++n) {
      if (n == k) continue;
      const std::string pair = {' ', initials[k], ' ', initials[n], ' '};
      if (words.find(pair) != std::string::npos) return true;
    }
  }
  return false;
}

}  // namespace

std::string without_identity(const std::string& text, const std::vector<std::string>& tags) {
  constexpr std::size_t kDate = 8, kLong = 4, kShort = 2;  // characters
  const std::string digits = only(text, std::isdigit, '\0'), named = digits_of_named_date(text);
  const std::string words = words_of(text);
  for (const std::string& tag : tags) {
    if (tag.size() == kDate && only(tag, std::isdigit, '\0') == tag) {
      for (const std::string& date : orders_of_date(tag)) {
        if (digits.find(date) != std::string::npos) return {};
        if (named.find(date) != std::string::npos) return {};
      }
    }
    if (holds_initials(words, tag)) return {};
    std::istringstream parts(only(tag, std::isalnum, ' '));
    for (std::string part; parts >> part;) {
      // A short part, as the name Li, counts as a word of its own alone; a short number, not at
      // all.
      const bool number = only(part, std::isdigit, '\0') == part;
      if (part.size() < (number ? kLong : kShort)) continue;
      const std::string sought = part.size() < kLong ? " " + part + " " : part;
      if (words.find(sought) != std::string::npos) return {};
    }
  }
  return text;
}

std::string without_date(const std::string& number) {
  constexpr std::size_t kDate = 8;  // characters
  const bool dated = number.size() == kDate && only(number, std::isdigit, '\0') == number &&
                     (number.starts_with("19") || number.starts_with("20"));
  return dated ? std::string() : number;
}

}  // namespace wireplan::preprocess
