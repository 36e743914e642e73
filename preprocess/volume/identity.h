#pragma once
/// What of a header may be shown: nothing that tells who the patient is and when it was; for the
/// .cpp files here.
#include <string>
#include <vector>

namespace wireplan::preprocess {

/// The text, or nothing where it holds one of the `tags` of its patient: a part of a name
/// ("LOVELACE^AUGUSTA") or its initials ("A.L."), a number, both split or parted otherwise too
/// ("MRN 123-4567" of "MRN1234567"), or a date in any order of day, month and year, in figures or
/// with the month's name.
std::string without_identity(const std::string& text, const std::vector<std::string>& tags);

/// The number, or nothing where it may be a date of these two centuries (19540321).
std::string without_date(const std::string& number);

}  // namespace wireplan::preprocess
