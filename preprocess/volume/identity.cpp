#include "preprocess/volume/identity.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <cstddef>
#include <set>
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

/// A text's runs of letters and of digits, in small letters.
std::vector<std::string> runs_of(const std::string& text) {
  const auto is_digit = [](char c) { return c >= '0' && c <= '9'; };
  std::vector<std::string> runs;
  std::istringstream words(only(text, std::isalnum, ' '));
  for (std::string word; words >> word;) {
    for (std::size_t k = 0; k < word.size(); ++k) {
      if (k == 0 || is_digit(word[k]) != is_digit(word[k - 1])) runs.emplace_back();
      runs.back() += word[k];
    }
  }
  return runs;
}

bool is_number(const std::string& text) { return only(text, std::isdigit, '\0') == text; }

/// The digits of a text, each number and each month's name with two digits at least: "2-Jan-2024"
/// has "02012024".
std::string digits_of_named_date(const std::vector<std::string>& runs) {
  std::string digits;
  for (const std::string& run : runs) {
    const bool number = is_number(run);
    const int month = number ? 0 : month_of(run);
    if (!number && month == 0) continue;
    const std::string found = number ? run : std::to_string(month);
    digits += (found.size() == 1 ? "0" : "") + found;
  }
  return digits;
}

/// Whether runs that follow one another are this together: "MRN 123-4567" holds "mrn1234567".
bool holds_joined(const std::vector<std::string>& runs, const std::string& sought) {
  for (std::size_t first = 0; first < runs.size(); ++first) {
    std::string joined;
    for (std::size_t k = first; k < runs.size() && joined.size() < sought.size(); ++k) {
      joined += runs[k];
    }
    if (joined == sought) return true;
  }
  return false;
}

/// What of a tag must not be shown: its words, all of it and each of its components (parted by ^)
/// without what parts their words, and numbers of these.
std::vector<std::string> secrets_of(const std::string& tag) {
  constexpr std::size_t kLong = 4, kShort = 2;  // characters
  std::vector<std::string> secrets;
  const auto add = [&](const std::string& one) {
    if (one.size() >= (is_number(one) ? kLong : kShort)) secrets.push_back(one);
  };
  std::istringstream parts(only(tag, std::isalnum, ' '));
  for (std::string part; parts >> part;) add(part);
  std::vector<std::string> joined = {only(tag, std::isalnum, '\0')};
  std::istringstream components(tag);
  for (std::string one; std::getline(components, one, '^');) {
    joined.push_back(only(one, std::isalnum, '\0'));
  }
  for (const std::string& all : joined) {
    add(all);
    for (const std::string& run : runs_of(all)) {
      if (is_number(run)) add(run);
    }
  }
  return secrets;
}

/// A short one, as the name Li, counts as a word of its own alone.
bool holds_secret(const std::string& words, const std::vector<std::string>& runs,
                  const std::string& secret) {
  constexpr std::size_t kLong = 4;  // characters
  if (secret.size() < kLong) return words.find(" " + secret + " ") != std::string::npos;
  return words.find(secret) != std::string::npos || holds_joined(runs, secret);
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
  constexpr std::size_t kDate = 8;  // characters
  const std::vector<std::string> runs = runs_of(text);
  const std::string digits = only(text, std::isdigit, '\0'), named = digits_of_named_date(runs);
  const std::string words = words_of(text);
  for (const std::string& tag : tags) {
    if (tag.size() == kDate && is_number(tag)) {
      for (const std::string& date : orders_of_date(tag)) {
        if (digits.find(date) != std::string::npos) return {};
        if (named.find(date) != std::string::npos) return {};
      }
    }
    if (holds_initials(words, tag)) return {};
    const std::vector<std::string> secrets = secrets_of(tag);
    if (std::any_of(secrets.begin(), secrets.end(),
                    [&](const std::string& secret) { return holds_secret(words, runs, secret); })) {
      return {};
    }
  }
  return text;
}

std::string without_person(const std::string& name) {
  constexpr std::size_t kManyInWord = 5, kMany = 6;  // digits
  static const std::set<std::string> kOfPatient = {"patient", "pat",       "mrn",   "dob",
                                                   "born",    "birthdate", "birth", "accession"};
  if (name.find('^') != std::string::npos) return {};
  const auto digits_of = [](const std::string& text) {
    return only(text, std::isdigit, '\0').size();
  };
  const std::vector<std::string> runs = runs_of(name);
  const bool month = std::any_of(runs.begin(), runs.end(),
                                 [](const std::string& run) { return month_of(run) > 0; });
  const bool many =
      digits_of(name) >= kMany || (month && digits_of_named_date(runs).size() >= kMany);
  std::string kept, word;
  bool changed = false;
  for (std::size_t k = 0; k <= name.size(); ++k) {
    const bool parts = k == name.size() || name[k] == ' ' || name[k] == '_' || name[k] == '\t';
    word += k < name.size() ? std::string(1, name[k]) : "";
    if (!parts) continue;
    const std::vector<std::string> of_word = runs_of(word);
    const auto is_of_patient = [](const std::string& run) { return kOfPatient.count(run) > 0; };
    if (std::any_of(of_word.begin(), of_word.end(), is_of_patient)) {
      changed = true;
      break;
    }
    const bool dated = month && many && of_word.size() == 1 && month_of(of_word[0]) > 0;
    const std::size_t digits = digits_of(word);
    if (digits >= kManyInWord || (many && digits > 0) || dated) {
      changed = true;
    } else {
      kept += word;
    }
    word.clear();
  }
  if (!changed) return name;
  const std::string marks = " _\t-,;:()[]/";
  const std::size_t first = kept.find_first_not_of(marks), last = kept.find_last_not_of(marks);
  return first == std::string::npos ? "" : kept.substr(first, last - first + 1);
}

std::string told_of_patient(const std::string& line) {
  const std::size_t mark = line.find_first_of(":=");
  if (mark == std::string::npos) return {};
  const std::string key = only(line.substr(0, mark), std::isalnum, '\0');
  const std::array<const char*, 8> words = {"patient", "birth",     "mrn",     "accession",
                                            "00100",   "studydate", "studyid", "referring"};
  const auto is_in_key = [&](const char* word) { return key.find(word) != std::string::npos; };
  if (std::none_of(words.begin(), words.end(), is_in_key)) return {};
  const std::size_t first = line.find_first_not_of(":= \t\"'", mark);
  if (first == std::string::npos) return {};
  return line.substr(first, line.find_last_not_of(" \t\r\"',") - first + 1);
}

std::string without_date(const std::string& number) {
  constexpr std::size_t kDate = 8;  // characters
  const bool dated = number.size() == kDate && is_number(number) &&
                     (number.starts_with("19") || number.starts_with("20"));
  return dated ? std::string() : number;
}

}  // namespace wireplan::preprocess
