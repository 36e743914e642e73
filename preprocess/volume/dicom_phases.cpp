#include "preprocess/volume/dicom_phases.h"

#include <algorithm>
#include <array>
#include <cstdio>
#include <utility>

#include "gdcmAttribute.h"
#include "preprocess/volume/dicom_elements.h"

namespace wireplan::preprocess {
namespace {

/// What parts images. Of some, parts one behind the other are one volume.
struct Parting {
  NamedTag named;
  const char* parts;
  bool may_follow = false;
  bool is_text = false;
};
constexpr std::array<Parting, 9> kPartings = {{
    {{0x20, 0x9056, "Stack ID (0020,9056)"}, "stacks", false, true},
    {{0x20, 0x9128, "Temporal Position Index (0020,9128)"}, "temporal positions"},
    {{0x20, 0x0100, "Temporal Position Identifier (0020,0100)"}, "temporal positions", false, true},
    {{0x20, 0x9241, "Nominal Percentage of Cardiac Phase (0020,9241)"}, "phases of the heart"},
    {{0x20, 0x9245, "Nominal Percentage of Respiratory Phase (0020,9245)"}, "phases of breath"},
    {{0x18, 0x9344, "Contrast/Bolus Agent Phase (0018,9344)"}, "contrast phases", false, true},
    {{0x20, 0x0012, "Acquisition Number (0020,0012)"}, "acquisitions", true, true},
    {{0x20, 0x9156, "Frame Acquisition Number (0020,9156)"}, "acquisitions", true},
    {{0x20, 0x930d, "Temporal Position Time Offset (0020,930D)"}, "times", true},
}};
constexpr Parting kOther{{}, "values of a dimension", true};

const Parting& parting_of(const std::string& name) {
  const auto found = std::find_if(kPartings.begin(), kPartings.end(),
                                  [&](const Parting& one) { return name == one.named.name; });
  return found == kPartings.end() ? kOther : *found;
}

/// How a dimension is called: as what it points to, where that is listed; empty where it is a
/// place.
std::string name_of_dimension(const gdcm::Tag& pointer) {
  for (const Parting& one : kPartings) {
    if (one.named.tag() == pointer) return one.named.name;
  }
  if (pointer == gdcm::Tag(0x20, 0x9057) || pointer == kPosition.tag()) return {};
  std::array<char, 24> text{};
  std::snprintf(text.data(), text.size(), "Dimension (%04X,%04X)", pointer.GetGroup(),
                pointer.GetElement());
  return text.data();
}

/// What the images are of, each with those that are of it, in the order in which they come.
std::vector<std::vector<std::size_t>> parts_of(const std::vector<std::string>& values) {
  std::vector<std::vector<std::size_t>> parts;
  std::map<std::string, std::size_t> seen;
  for (std::size_t k = 0; k < values.size(); ++k) {
    const auto [at, is_new] = seen.try_emplace(values[k], parts.size());
    if (is_new) parts.emplace_back();
    parts[at->second].push_back(k);
  }
  return parts;
}

/// What the images tell under a name. One that tells nothing is of its neighbour's in the order.
std::vector<std::string> values_of(const std::vector<const DicomPhase*>& images,
                                   const std::vector<std::size_t>& order, const std::string& name) {
  std::vector<std::string> values(images.size());
  std::string last;
  for (const std::size_t k : order) {  // the first that tells it, for those before
    if (!images[k]->contains(name)) continue;
    last = images[k]->at(name);
    break;
  }
  for (const std::size_t k : order) {
    if (images[k]->contains(name)) last = images[k]->at(name);
    values[k] = last;
  }
  return values;
}

/// How often the value changes along the order.
std::size_t count_changes(const std::vector<std::string>& values,
                          const std::vector<std::size_t>& order) {
  std::size_t changes = 0;
  for (std::size_t k = 1; k < order.size(); ++k) {
    changes += values[order[k]] == values[order[k - 1]] ? 0 : 1;
  }
  return changes;
}

}  // namespace

std::vector<gdcm::Tag> read_dimensions(const gdcm::DataSet& data) {
  const gdcm::Tag sequence(0x20, 0x9222);
  std::vector<gdcm::Tag> pointers;
  if (!data.FindDataElement(sequence)) return pointers;
  const auto items = data.GetDataElement(sequence).GetValueAsSQ();
  for (std::size_t k = 1; items && k <= items->GetNumberOfItems(); ++k) {
    gdcm::Attribute<0x0020, 0x9165> pointer;
    const gdcm::DataSet& item = items->GetItem(k).GetNestedDataSet();
    const bool told = dicom_bytes(item, pointer.GetTag()).size() == 4;
    if (told) pointer.SetFromDataElement(item.GetDataElement(pointer.GetTag()));
    pointers.push_back(told ? pointer.GetValue() : gdcm::Tag());
  }
  return pointers;
}

void read_phase(const gdcm::DataSet& data, const std::vector<gdcm::Tag>& pointers,
                DicomPhase& phase) {
  const auto read = [&](const gdcm::DataSet& elements) {
    for (const Parting& one : kPartings) {
      std::string value = dicom_bytes(elements, one.named.tag());
      if (one.is_text) value = without_padding(std::move(value));
      if (!value.empty()) phase[one.named.name] = std::move(value);
    }
  };
  read(data);
  // Content of the frame; heart, breath, time and contrast (PS3.3 section C.7.6.16.2).
  for (const gdcm::Tag& group :
       {gdcm::Tag(0x20, 0x9111), gdcm::Tag(0x18, 0x9118), gdcm::Tag(0x20, 0x9253),
        gdcm::Tag(0x20, 0x9310), gdcm::Tag(0x18, 0x9341)}) {
    in_first_item(data, group, read);
  }
  in_first_item(data, {0x20, 0x9111}, [&](const gdcm::DataSet& content) {
    const std::string indices = dicom_bytes(content, {0x20, 0x9157});
    constexpr std::size_t kBytes = 4;  // of each
    for (std::size_t k = 0; kBytes * k < indices.size(); ++k) {
      const std::string name = k < pointers.size() ? name_of_dimension(pointers[k])
                                                   : "Dimension Index Values (0020,9157), number " +
                                                         std::to_string(k + 1);
      if (!name.empty()) phase.try_emplace(name, indices.substr(kBytes * k, kBytes));
    }
  });
}

DicomParts find_parts(const std::vector<const DicomPhase*>& images,
                      const std::vector<std::size_t>& order) {
  DicomPhase all;
  for (const DicomPhase* image : images) all.insert(image->begin(), image->end());
  for (const bool may_follow : {false, true}) {  // what parts them in any order first
    for (const auto& [name, any] : all) {
      const Parting& parting = parting_of(name);
      if (parting.may_follow != may_follow) continue;
      const std::vector<std::string> values = values_of(images, order, name);
      std::vector<std::vector<std::size_t>> parts = parts_of(values);
      if (parts.size() == 1 || parts.size() == images.size()) continue;
      if (may_follow && count_changes(values, order) == parts.size() - 1) continue;
      return {.what = std::to_string(parts.size()) + " " + parting.parts + " (" + name + ")" +
                      (may_follow ? " that lie between one another" : ""),
              .images = std::move(parts)};
    }
  }
  return {};
}

}  // namespace wireplan::preprocess
