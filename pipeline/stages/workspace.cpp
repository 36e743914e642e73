#include "pipeline/stages/workspace.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "pipeline/files/text.h"
#include "pipeline/report/report.h"
#include "pipeline/stages/held_places.h"
#include "plan/anatomy/branch_names.h"
#include "plan/catheter_choice.h"
#include "plan/score.h"
#include "preprocess/centerline/centerline.h"
#include "preprocess/cores.h"
#include "preprocess/files/vessel_io.h"

namespace wireplan::pipeline {
namespace {

namespace fs = std::filesystem;

// The direction of the vessel at the access is that of its first centimetre.
constexpr double kTangentSpan = 10.0;
// Wire that is brought along where the case leaves it open: a wire does not keep to the middle.
constexpr double kInsertionFactor = 1.25, kInsertionExtra = 20.0;

// How far from an axis contact reaches, of the thickest tool of the study [mm].
double felt_from_axis(const plan::Study& study) {
  double radius = 0.0;
  for (const simulate::Wire& wire : study.wires) radius = std::max(radius, wire.radius);
  for (const plan::Catheter& catheter : study.catheters) {
    radius = std::max(radius, catheter.tool.wire.radius);
  }
  return radius + study.insertion.contact_law.reach();
}

// The tree as find_tree() made it, back from the artifact of stage centerline.
std::vector<preprocess::Branch> read_tree(const Workspace& work) {
  std::vector<Centerline> lines =
      preprocess::read_centerlines(work.artifact("centerline").folder / "tree.vtp");
  const Json branches = work.figures("centerline").at("branches");
  expects(lines.size() == branches.size());
  std::vector<preprocess::Branch> tree;
  for (std::size_t k = 0; k < lines.size(); ++k) {
    // The parent is told by its name.
    const auto parent = std::find_if(branches.begin(), branches.end(), [&](const Json& other) {
      return other.at("name") == branches[k].at("parent");
    });
    std::vector<preprocess::NamedPart> parts;
    for (const Json& part : branches[k].at("parts")) {
      parts.push_back({part.at("from_mm").get<double>(), part.at("name").get<std::string>()});
    }
    tree.push_back(
        {.line = std::move(lines[k]),
         .parent = parent == branches.end() ? -1 : static_cast<int>(parent - branches.begin()),
         .parent_arc = branches[k].at("parent_arc_mm").get<double>(),
         .parts = std::move(parts)});
  }
  return tree;
}

// The tree with branches called after the case's accesses and targets, as a section to that target
// calls them.
std::vector<preprocess::Branch> named_tree(const Case& given, std::vector<preprocess::Branch> tree,
                                           std::size_t target) {
  std::vector<plan::NamedPlace> targets, accesses;
  for (std::size_t k = 0; k < given.targets.size(); ++k) {
    if (k != target) targets.push_back({given.targets[k].name, given.targets[k].point});
  }
  for (std::size_t k = 0; k < given.accesses.size(); ++k) {
    if (k != given.access) accesses.push_back({given.accesses[k].name, given.accesses[k].point});
  }
  plan::name_branches(tree, {given.targets[target].name, given.targets[target].point}, targets,
                      accesses);
  return tree;
}

// Enough wire for a way round the middle to the furthest goal, as far as the shortest wire goes.
double choose_insertion(const plan::Study& study) {
  const auto length_of = [](const simulate::Goal& goal) {
    return goal.way->path().arc_length.tail<1>().value();
  };
  double path_length = length_of(study.goal);
  for (const simulate::Goal& other : study.others) {
    path_length = std::max(path_length, length_of(other));
  }
  double length = std::ceil(kInsertionFactor * path_length + kInsertionExtra);
  for (const simulate::Wire& wire : study.wires) length = std::min(length, wire.length());
  return length;
}

}  // namespace

std::vector<std::size_t> targets_served(const Case& given) {
  if (!given.targets[given.target].at_section) return {given.target};
  std::vector<std::size_t> served;
  for (std::size_t k = 0; k < given.targets.size(); ++k) {
    if (given.targets[k].at_section) served.push_back(k);
  }
  return served;
}

std::string centerline_toward(std::size_t target) {
  return "centerline toward " + std::to_string(target);
}

Json figures_of(const std::string& stage) {
  return {{"schema", "wireplan." + stage + "/1"}, {"warnings", Json::array()}};
}

void write_figures(const Json& figures, const fs::path& folder) {
  write_json(figures, folder / kFiguresFile);
}

Workspace::Workspace(Case given, WorkOptions options, Store store)
    : given_(std::move(given)),
      options_(std::move(options)),
      store_(std::move(store)),
      models_(options_.models ? options_.models : std::make_shared<ModelStock>()) {
  input = input_path(given_);
}

const Artifact& Workspace::artifact(const std::string& stage) const {
  const auto found = artifacts_.find(stage);
  expects(found != artifacts_.end());
  return found->second;
}

Json Workspace::figures(const std::string& stage) const {
  return read_json(artifact(stage).folder / kFiguresFile, "wireplan." + stage + "/1");
}

const preprocess::Image& Workspace::image() {
  if (!image_) image_ = preprocess::read_image(input, given_.volume->series);
  return *image_;
}

const Surface& Workspace::surface() {
  if (!surface_) {
    surface_ = preprocess::read_surface_artifact(artifact("surface").folder / "surface.vtp");
  }
  return *surface_;
}

const Centerline& Workspace::path() {
  if (!path_) {
    path_ = preprocess::read_centerline(artifact("centerline").folder / "centerline.vtp");
  }
  return *path_;
}

const Wall& Workspace::wall() {
  if (!wall_) {
    wall_ = preprocess::read_wall(artifact("wall").folder / "wall.vtu");
    expects(wall_->apexes.cols() == surface().triangles.cols());
  }
  return *wall_;
}

std::string Workspace::field_key_text() const {
  // The program stands for how it is made.
  return pipeline::key_text({{"piece", "field"},
                             {"input surface", artifact("surface").contents()},
                             {"yields", given_.wall.elastic ? "true" : "false"},
                             {"felt", format("%.17g", felt_from_axis(given_.study))},
                             {"program", build_info().dump()}});
}

ModelStock& Workspace::models() {
  std::string made_from = field_key_text();
  if (given_.wall.elastic && has("wall")) made_from += artifact("wall").contents();
  if (models_->made_from != made_from) *models_ = ModelStock{.made_from = std::move(made_from)};
  return *models_;
}

bool Workspace::find_field() {
  const std::optional<fs::path> kept = store_.find_piece(field_key_text());
  if (!kept) return false;
  std::optional<simulate::Lumen> field = simulate::Lumen::from_bytes(read_if_there(*kept));
  if (!field) return false;
  models().model = std::make_unique<simulate::VesselModel>(surface(), std::move(*field));
  return true;
}

void Workspace::share_field() {
  if (models().model) return;
  const std::optional<FileLock> lock = store_.lock("field", field_key_text(), options_.cancelled);
  if (!lock) throw Interrupted();
  if (!find_field()) store_.keep_piece(field_key_text(), rigid_model().lumen.to_bytes());
}

/// Of the field as a yielding wall needs it, since the wall may come later.
simulate::LumenOptions Workspace::field_options() {
  simulate::LumenOptions options = simulate::follow(surface(), felt_from_axis(given_.study));
  if (given_.wall.elastic) options.band = simulate::VesselModel::yielding_band(options);
  return options;
}

bool Workspace::may_begin() const { return simulates && options_.threads != 1 && core_count() > 1; }

void Workspace::begin_field() {
  if (!may_begin() || models_->model || store_.find_piece(field_key_text())) return;
  // A copy: who asked may be gone before the field is done.
  field_begun_ = std::async(std::launch::async, [from = surface(), options = field_options()] {
    return std::make_unique<simulate::VesselModel>(from, options);
  });
}

void Workspace::begin_compliance() {
  const ModelStock& stock = models();
  const bool has = stock.compliance_aside || (stock.model && stock.model->compliance);
  if (!may_begin() || !given_.wall.elastic || has) return;
  compliance_begun_ = std::async(
      std::launch::async,
      [from = surface(), wall = wall()]() -> std::unique_ptr<const simulate::WallCompliance> {
        return std::make_unique<const simulate::WallCompliance>(from, wall);
      });
}

const simulate::VesselModel& Workspace::rigid_model() {
  ModelStock& stock = models();
  if (!stock.model && field_begun_.valid()) stock.model = field_begun_.get();
  if (!stock.model && !find_field()) {
    stock.model = std::make_unique<simulate::VesselModel>(surface(), field_options());
  }
  if (stock.model->compliance) stock.compliance_aside = std::move(stock.model->compliance);
  if (stock.model->sections) stock.sections_aside = std::move(stock.model->sections);
  return *stock.model;
}

const simulate::VesselModel& Workspace::model() {
  ModelStock& stock = models();
  if (stock.model && stock.model->compliance) {
    let_sections_move(stock);
    return *stock.model;
  }
  rigid_model();
  if (given_.wall.elastic) {
    if (!stock.compliance_aside && compliance_begun_.valid()) {
      stock.compliance_aside = compliance_begun_.get();
    }
    if (!stock.compliance_aside) {
      stock.compliance_aside = std::make_unique<simulate::WallCompliance>(surface(), wall());
    }
    stock.model->compliance = std::move(stock.compliance_aside);
  }
  let_sections_move(stock);
  return *stock.model;
}

std::function<const simulate::VesselModel&()> Workspace::moving_model() {
  if (!given_.wall.support) return {};
  return [this]() -> const simulate::VesselModel& {
    rigid_model();
    let_sections_move(models());
    return *models().model;
  };
}

std::unique_ptr<const simulate::SectionChain> Workspace::section_chain() {
  if (!given_.wall.support) return nullptr;
  return make_section_chain(given_.wall, read_tree(*this), given_.study.access,
                            wall().young_modulus);
}

void Workspace::let_sections_move(ModelStock& stock) {
  if (!given_.wall.support) return;
  std::string made_from = artifact("centerline").contents() + artifact("wall").contents() +
                          to_json(given_.study.access).dump() + parameters.at("wall").dump();
  if (stock.sections_made_from != made_from) {
    stock.sections_aside = section_chain();
    stock.sections_made_from = std::move(made_from);
    stock.model->sections = nullptr;
  }
  if (!stock.model->sections) stock.model->sections = std::move(stock.sections_aside);
}

std::string Workspace::piece(std::vector<KeyLine> key,
                             const std::function<std::string()>& make) const {
  key.push_back({"program", build_info().dump()});
  const std::string text = key_text(key);
  if (const std::optional<fs::path> kept = store_.find_piece(text)) return read_if_there(*kept);
  std::string bytes = make();
  store_.keep_piece(text, bytes);
  return bytes;
}

const plan::Study& Workspace::study() {
  if (study_) return *study_;
  plan::Study study = given_.study;
  const std::vector<preprocess::Branch> tree = read_tree(*this);
  const auto set_way = [&](simulate::Goal& goal, const Centerline& path, std::size_t target) {
    goal.way = std::make_shared<simulate::Way>(path, named_tree(given_, tree, target));
    if (goal.at_section) goal.radius = goal.way->section().radius;
  };
  set_way(study.goal, path(), given_.target);
  study.tangent = preprocess::start_tangent(path(), kTangentSpan);
  const std::vector<std::size_t> served = targets_served(given_);
  for (const std::size_t k : served) {
    if (k == given_.target) continue;
    const Centerline other =
        preprocess::read_centerline(artifact(centerline_toward(k)).folder / "centerline.vtp");
    set_way(study.others.emplace_back(
                simulate::Goal{.point = given_.targets[k].point, .at_section = true}),
            other, k);
    if (k == served.front()) study.tangent = preprocess::start_tangent(other, kTangentSpan);
  }
  if (study.insertion.length == 0.0) study.insertion.length = choose_insertion(study);
  if (given_.suggest_catheters) plan::keep_suggested(study);
  if (study.catheters.empty() && plan::sum_of(given_.weights, false) <= 0.0) {
    throw Error(given_.file.string() +
                ": ranking.weights are 0 in all, expected one above 0 where no catheter is "
                "suggested, as for this way, since script_weights act with catheters alone; raise "
                "one, or name catheters");
  }
  study_ = std::move(study);
  return *study_;
}

}  // namespace wireplan::pipeline
