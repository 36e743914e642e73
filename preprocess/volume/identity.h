#pragma once
/// What of a header or a table may be shown: nothing that tells who the patient is and when it was.
#include <string>
#include <vector>

namespace wireplan::preprocess {

/// The text, or nothing where it holds one of the `tags` of its patient: a part of a name
/// ("LOVELACE^AUGUSTA") or its initials ("A.L."), a number, both split or parted otherwise too
/// ("MRN 123-4567" of "MRN1234567"), or a date in any order of day, month and year, in figures or
/// with the month's name.
std::string without_identity(const std::string& text, const std::vector<std::string>& tags);

/// The name of a class or a point without what may tell who somebody is: nothing of one with a ^,
/// as DICOM parts a person's names; no word of five digits or more, or of many in all, as numbers
/// and dates have; nothing from a word for a patient on ("patient", "MRN", "born"). Else as it is.
std::string without_person(const std::string& name);

/// What a line of a header or a comment says of its patient or study ("patient name: Lovelace"), to
/// hide it elsewhere; empty where it says nothing of them.
std::string told_of_patient(const std::string& line);

/// The number, or nothing where it may be a date of these two centuries (19540321).
std::string without_date(const std::string& number);

}  // namespace wireplan::preprocess
