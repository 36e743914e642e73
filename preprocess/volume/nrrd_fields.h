#pragma once
/// The fields of an NRRD's header (https://teem.sourceforge.net/nrrd/format.html); for the .cpp
/// files here.
#include <filesystem>
#include <map>
#include <string>
#include <vector>

namespace wireplan::preprocess {

/// By their names in small letters and without other spellings.
using NrrdFields = std::map<std::string, std::string>;

/// "name: value" of each line, in small letters but for the name of a file. NrrdIO writes a line
/// that it does not understand into 1024 characters of its stack, so long ones are refused: all but
/// comments, what somebody adds as "key:=value", and "content", which is taken as it is. Throws
/// `Error` where it is no NRRD, and for lines that are no fields, by their number.
NrrdFields read_nrrd_fields(const std::filesystem::path& path);

/// Refuses fields that contradict one another or are none, of which NrrdIO says no more than that
/// the header is wrong.
void require_sound_fields(const NrrdFields& fields, const std::filesystem::path& path);

/// Empty where the header has no such field.
std::string value_of(const NrrdFields& fields, const std::string& key);

/// The vectors "(1,0,0) (0,1,0) none" of a field; empty ones of axes that have none.
std::vector<std::vector<double>> vectors_of(std::string text);

/// The words of a field that has one for each axis.
std::vector<std::string> axis_words(const NrrdFields& fields, const std::string& key);

}  // namespace wireplan::preprocess
