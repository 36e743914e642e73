#include "pipeline/commands/new_case.h"

#include <algorithm>
#include <cctype>
#include <iostream>
#include <memory>

#include "pipeline/commands/commands.h"
#include "pipeline/commands/subcommands.h"
#include "pipeline/files/case_file.h"
#include "pipeline/files/disk.h"
#include "pipeline/files/labels_file.h"
#include "pipeline/files/markups_file.h"
#include "pipeline/files/text.h"
#include "pipeline/report/inspect.h"
#include "pipeline/stages/makers.h"
#include "preprocess/text.h"
#include "preprocess/volume/image.h"
#include "preprocess/volume/labels.h"
#include "preprocess/volume/voxels.h"

namespace wireplan::pipeline {
namespace {

namespace fs = std::filesystem;

constexpr double kBloodHu = 100.0;  // with contrast it has more
constexpr const char* kMarkups = "points.mrk.json";
constexpr const char* kWires = R"(["glidewire-angled", "amplatz-stiff", "amplatz-stiff-angled"])";

/// As a case file in the folder names it.
std::string path_from(const fs::path& folder, const fs::path& file) {
  const auto whole = [](const fs::path& path) { return fs::weakly_canonical(fs::absolute(path)); };
  return fs::proximate(whole(file), whole(folder)).generic_string();
}

/// The folder's name, of characters that the name of a case may have.
std::string case_name(const fs::path& folder) {
  const fs::path whole = fs::weakly_canonical(fs::absolute(folder));
  std::string name = (whole.has_filename() ? whole : whole.parent_path()).filename().string();
  for (char& c : name) {
    if (std::isalnum(static_cast<unsigned char>(c)) == 0 && c != '-' && c != '_') c = '-';
  }
  return name.empty() ? "case" : name;
}

bool begins_as(const std::string& label, const std::string& word) {
  return lower_case(label).starts_with(word);
}

/// "ct.nrrd: CT of 512 x 512 x 119 voxels of 0.74 x 0.74 x 1.6 mm"
std::string volume_line(const fs::path& path, const preprocess::Image& image) {
  const preprocess::Grid& grid = image.grid;
  return path.filename().string() + ": " +
         (image.modality.empty() ? std::string("a volume") : image.modality) +
         format(" of %d x %d x %d voxels of %.3g x %.3g x %.3g mm", grid.size[0], grid.size[1],
                grid.size[2], grid.spacing[0], grid.spacing[1], grid.spacing[2]);
}

bool has_word(const std::string& name, const std::string& word) {
  return lower_case(name).find(word) != std::string::npos;
}

/// Whether the name of a class is an artery's, as segmentation tools and people call them.
bool is_artery(const std::string& name) {
  for (const char* word :
       {"vein", "vena", "venous", "portal", "false", "thromb", "wall", "head", "neck", "nerve",
        "muscle", "iliacus", "crest", "bone", "plaque", "calci"}) {
    if (has_word(name, word)) return false;
  }
  for (const char* word : {"aort", "arter", "iliac", "femoral", "carotid", "subclavian", "celiac",
                           "brachiocephalic_trunk", "brachiocephalic trunk", "mesenteric"}) {
    if (has_word(name, word)) return true;
  }
  return false;
}

/// "aorta (113 ml)"
std::string class_text(const preprocess::ListedClass& one) {
  return (one.name.empty() ? "label " + std::to_string(one.value) : one.name) +
         format(" (%.3g ml)", one.volume_mm3 / 1000.0);
}

class CaseMaker {
 public:
  explicit CaseMaker(const NewCase& given) : given_(given) {}

  NewCaseAnswer write() {
    require_folder(given_.folder, "the case (DIR)");
    const fs::path file = given_.folder / "case.json";
    if (fs::exists(file)) {
      throw Error(file.string() + ": is there already; give another folder, or delete it");
    }
    if (!given_.series.empty() && given_.volume.empty()) {
      throw Error("--series " + given_.series +
                  ": given without --volume, expected both; it chooses of a folder of DICOM files");
    }
    case_ = {{"schema", "wireplan.case/1"}, {"name", case_name(given_.folder)}};
    if (!given_.volume.empty()) {
      read_volume();
      case_["volume"]["path"] = path_from(given_.folder, given_.volume);
      if (!given_.series.empty()) case_["volume"]["series"] = given_.series;
    }
    if (!given_.labels.empty()) read_classes();
    if (given_.markups.empty() && arteries_.size() > 1) {
      propose_branches();
    } else if (given_.markups.empty()) {
      ask_for_points();
    } else {
      take_points(read_markups(given_.markups));
    }
    case_["wires"] = Json::parse(kWires);
    fs::create_directories(given_.folder);
    write_json(case_, file);
    if (answer_.missing.empty()) check(file);
    write_whole(readme(), given_.folder / "README.md");
    return std::move(answer_);
  }

 private:
  void read_volume() {
    const Json told = inspect(given_.volume);
    const std::string path = given_.volume.string(), kind = told.at("kind");
    if (kind == "surface" || kind == "labels") {
      throw Error(path + ": holds " + (kind == "labels" ? "labels" : "a surface") +
                  ", expected a CT; write the case by hand as README.md shows it");
    }
    image_ = preprocess::read_image(given_.volume, given_.series);
    answer_.found.push_back(volume_line(given_.volume, image_));
    for (const std::string& remark : image_.remarks) answer_.found.push_back("volume: " + remark);
    told_ = inspect_text(told);
  }

  /// The classes of the labels, those of them that are arteries by their names, and what is missing
  /// where none is.
  void read_classes() {
    const std::string path = given_.labels.string();
    const FoundTable table = find_label_table(given_.labels);
    const preprocess::LabelListing listing = preprocess::list_labels(given_.labels, table.names);
    for (const std::string& remark : listing.remarks) {
      answer_.found.push_back("labels: " + remark);
    }
    if (!table.problem.empty()) {
      answer_.found.push_back("the table beside the labels is not read: " + table.problem);
    }
    std::string all, chosen;
    for (const preprocess::ListedClass& one : listing.classes) {
      if (one.voxels == 0) continue;
      all += (all.empty() ? "" : ", ") + class_text(one);
      if (!is_artery(one.name)) continue;
      chosen += (chosen.empty() ? "" : ", ") + one.name;
      arteries_.push_back(one);
    }
    if (all.empty()) {
      throw Error(path +
                  ": holds no class with a voxel, expected labels of arteries; give another "
                  "file or folder");
    }
    answer_.found.push_back(given_.labels.filename().string() + ": labels " + all);
    Json& labels = case_["labels"];
    labels["path"] = path_from(given_.folder, given_.labels);
    const bool one_file = !fs::is_directory(given_.labels);
    if (listing.classes.size() == 1 && one_file) return;  // it is the lumen, whatever it is called
    for (const preprocess::ListedClass& one : arteries_) labels["names"].push_back(one.name);
    if (!arteries_.empty()) {
      answer_.found.push_back("by their names these are arteries, and labels.names has them: " +
                              chosen);
    } else {
      answer_.missing.push_back(
          std::string("The classes that are arteries, none of which has an artery's name: as "
                      "labels.names") +
          (one_file ? ", or by number as labels.values in its place" : "") + ", of " + all + ".");
    }
  }

  /// From the largest artery's lower end, or an iliac's or femoral's, to the smallest.
  void propose_branches() {
    const auto smaller = [](const auto& a, const auto& b) { return a.volume_mm3 < b.volume_mm3; };
    const auto trunk = std::max_element(arteries_.begin(), arteries_.end(), smaller);
    const auto from = std::find_if(arteries_.begin(), arteries_.end(), [](const auto& one) {
      return has_word(one.name, "iliac") || has_word(one.name, "femoral");
    });
    const auto access = from == arteries_.end() ? trunk : from;
    auto target = arteries_.end();
    for (auto one = arteries_.begin(); one != arteries_.end(); ++one) {
      if (one == access || one == trunk) continue;
      if (target == arteries_.end() || smaller(*one, *target)) target = one;
    }
    if (target == arteries_.end()) target = trunk;
    case_["access"] = {{"branch", access->name}, {"end", access == trunk ? "inferior" : "distal"}};
    case_["target"] = {{"branch", target->name}, {"end", target == trunk ? "superior" : "distal"}};
    answer_.found.push_back("proposed, for you to change: the access at the " +
                            case_["access"]["end"].get<std::string>() + " end of " + access->name +
                            ", the target at the " + case_["target"]["end"].get<std::string>() +
                            " end of " + target->name);
  }

  void ask_for_points() {
    for (const char* end : {"access", "target"}) {
      case_[end] = {{"point", {{"markups", kMarkups}, {"label", end}}}};
    }
    answer_.missing.push_back(
        std::string("Two points in the lumen: in 3D Slicer load the images, place them, name them "
                    "\"access\" and \"target\", and save them as ") +
        (given_.folder / kMarkups).string() + ".");
  }

  void take_points(const Markups& read) {
    const std::vector<MarkupPoint>& points = read.points;
    for (const MarkupPoint& point : points) tell_point(point);
    for (const std::string& label : read.unplaced) {
      answer_.found.push_back("\"" + label + "\" is there but has no position: place it");
    }
    std::vector<std::string> accesses, targets, others;
    for (const MarkupPoint& point : points) {
      (begins_as(point.label, "access")   ? accesses
       : begins_as(point.label, "target") ? targets
                                          : others)
          .push_back(point.label);
    }
    if (points.size() == 2 && others.size() == 2) {
      accesses = {others[0]};
      targets = {others[1]};
      others.clear();
      answer_.found.push_back("\"" + accesses[0] + "\" is taken as the access, \"" + targets[0] +
                              "\" as the target");
    }
    put_ends("access", "accesses", accesses);
    put_ends("target", "targets", targets);
    for (const std::string& label : others) {
      answer_.found.push_back("\"" + label +
                              "\" is not used: neither \"access\" nor \"target\" begins its name");
    }
  }

  void tell_point(const MarkupPoint& point) {
    std::string line =
        "\"" + point.label + "\" at (" +
        format("%.1f, %.1f, %.1f) mm LPS", point.point.x(), point.point.y(), point.point.z());
    if (given_.volume.empty()) return answer_.found.push_back(line);
    line += ", ";
    const auto voxel = preprocess::nearest_voxel(image_.grid, point.point);
    if (!voxel) {
      answer_.found.push_back(line + "outside of the volume");
      answer_.missing.push_back("The point \"" + point.label +
                                "\" inside the volume: it lies outside; place it again.");
      return;
    }
    const double value = image_.values[preprocess::index_of(image_.grid, *voxel)];
    line += format("voxel (%d, %d, %d): %.0f", (*voxel)[0], (*voxel)[1], (*voxel)[2], value);
    line += image_.modality == "CT" ? " HU" : "";
    if (value < kBloodHu) line += ", less than blood with contrast has; is it in the lumen?";
    answer_.found.push_back(line);
  }

  /// `one` for a single label; the list with names for several.
  void put_ends(const std::string& one, const std::string& list,
                const std::vector<std::string>& labels) {
    const std::string markups = path_from(given_.folder, given_.markups);
    const auto point = [&](const std::string& label) {
      return Json{{"markups", markups}, {"label", label}};
    };
    if (labels.size() > 1) {
      for (const std::string& label : labels) {
        case_[list].push_back({{"name", label}, {"point", point(label)}});
      }
      return;
    }
    case_[one]["point"] = point(labels.empty() ? one : labels.front());
    if (labels.empty()) {
      answer_.missing.push_back("A point named \"" + one + "\" in " + given_.markups.string() +
                                ", in the lumen.");
    }
  }

  void check(const fs::path& file) {
    try {
      const Case made = read_case(file);
      if (!made.labels) return;
      for (const std::string& told : check_labels(made, made.volume ? &image_ : nullptr)) {
        answer_.found.push_back(told);
      }
    } catch (const DiskError&) {
      throw;
    } catch (const Error& error) {
      answer_.missing.emplace_back(error.what());
    }
  }

  std::string readme() const {
    const std::string name = case_.at("name");
    std::string text = "# " + name + "\nA case of wireplan. Research use only.\n\n";
    text += "## What was found\n";
    if (!told_.empty()) text += "```\n" + told_ + "```\n";
    for (const std::string& line : answer_.found) text += "- " + line + "\n";
    text += "\n## What is missing\n";
    for (const std::string& line : answer_.missing) text += "- " + line + "\n";
    if (answer_.missing.empty()) text += "Nothing.\n";
    return text + R"(
## What case.json says
| key | what it is |
|---|---|
| `volume` | the CT, from this folder |
| `labels` | somebody's segmentation in its place or beside it; `names` are the classes that are arteries |
| `access`, `target` | where the wires go in and where to, in the lumen; `accesses`, `targets` are lists of both, with names. `"point": {"markups": FILE, "label": NAME}` is a point of 3D Slicer, `{"ijk": [I, J, K]}` a voxel, `"point_mm"` three numbers in LPS; with labels `"branch": NAME` with `"end"` or `"beyond_ostium_mm"` |
| `wires` | of the catalogue (`wireplan wires` lists it) or of your own |

All other keys have defaults; `pipeline/schemas/case.schema.json` explains each.

## To do
```
wireplan check .
wireplan run .
```
)";
  }

  const NewCase& given_;
  preprocess::Image image_;
  std::string told_;                               // of the volume
  std::vector<preprocess::ListedClass> arteries_;  // of the labels, by their names
  Json case_;
  NewCaseAnswer answer_;
};

}  // namespace

NewCaseAnswer write_new_case(const NewCase& given) { return CaseMaker(given).write(); }

void add_new(CLI::App& app, int& code) {
  const auto given = std::make_shared<NewCase>();
  CLI::App* command = app.add_subcommand("new", "Write the folder of a case for a CT or labels");
  command->add_option("DIR", given->folder, "Folder of the case")->required();
  command->add_option("--volume", given->volume, "Folder of DICOM files, NIfTI, NRRD or MetaImage");
  command->add_option("--series", given->series,
                      "Of a DICOM folder, by number, description or key");
  command->add_option("--markups", given->markups,
                      "Points of 3D Slicer (.mrk.json, .fcsv, .csv), named access and target");
  command->add_option("--labels", given->labels,
                      "A volume of labels, a .seg.nrrd, or a folder with one file per class");
  command->footer(
      "Writes DIR/case.json and DIR/README.md, and says what was found and what is missing.\n"
      "Example: wireplan new patient-7 --volume ct.nii.gz --markups points.mrk.json");
  command->callback([&code, given] {
    if (given->volume.empty() && given->labels.empty()) {
      throw CLI::RequiredError("--volume or --labels");
    }
    const NewCaseAnswer answer = write_new_case(*given);
    for (const std::string& line : answer.found) std::cout << "found: " << line << "\n";
    for (const std::string& line : answer.missing) std::cout << "missing: " << line << "\n";
    std::cout << "case: " << (given->folder / "case.json").string() << "\n";
    code = kDone;
  });
}

}  // namespace wireplan::pipeline
