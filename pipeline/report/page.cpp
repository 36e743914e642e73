#include "pipeline/report/page.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>

#include "pipeline/store/hash.h"

namespace wireplan::pipeline {
namespace {

static_assert(std::endian::native == std::endian::little, "the page reads little-endian arrays");

constexpr const char* kPageSchema = "wireplan.page/1";
constexpr double kSteps = 65535.0;  // points are kept in 16 bits per axis, over the scene's box

template <typename Number>
std::string encode(const std::vector<Number>& values) {
  return base64(values.data(), values.size() * sizeof(Number));
}

template <typename Values>
std::string encode_floats(const Values& values) {
  return encode(std::vector<float>(values.begin(), values.end()));
}

/// The box that all points of a page lie in.
class Quantiser {
 public:
  template <typename Points>
  void include(const Points& points) {
    for (const auto& point : points.colwise()) {
      const Vec3 p = point.template cast<double>();
      if (!p.allFinite()) continue;
      low_ = low_.cwiseMin(p);
      high_ = high_.cwiseMax(p);
    }
  }

  /// Columns as unsigned 16 bit numbers, x, y, z in turn. What is not finite goes to the low
  /// corner.
  template <typename Points>
  std::string encode_points(const Points& points) const {
    std::vector<std::uint16_t> steps;
    steps.reserve(static_cast<std::size_t>(points.size()));
    for (const auto& point : points.colwise()) {
      for (int axis = 0; axis < 3; ++axis) {
        const double part = (static_cast<double>(point[axis]) - low_[axis]) / size()[axis];
        steps.push_back(static_cast<std::uint16_t>(
            std::isfinite(part) ? std::lround(kSteps * std::clamp(part, 0.0, 1.0)) : 0));
      }
    }
    return encode(steps);
  }

  Json to_json() const {
    return {{"low_mm", pipeline::to_json(low_)}, {"size_mm", pipeline::to_json(size())}};
  }

 private:
  Vec3 size() const { return (high_ - low_).cwiseMax(1e-3); }
  Vec3 low_ = Vec3::Constant(1e30), high_ = Vec3::Constant(-1e30);
};

Quantiser fit_box(const PageInput& input) {
  Quantiser box;
  box.include(input.surface.vertices);
  box.include(input.path.points);
  box.include(input.access);
  box.include(input.target);
  for (const PageTrial& trial : input.trials) box.include(trial.nodes);
  for (const PageInsertion& insertion : input.insertions) {
    for (const simulate::Shape& shape : insertion.shapes) box.include(shape.nodes);
  }
  return box;
}

Json surface_json(const PageInput& input, const Quantiser& box) {
  std::vector<std::uint32_t> corners(input.surface.triangles.reshaped().begin(),
                                     input.surface.triangles.reshaped().end());
  return {{"vertices", box.encode_points(input.surface.vertices)},
          {"triangles", encode(corners)},
          {"peak_force_n", encode_floats(input.peak_force)}};
}

Json trials_json(const PageInput& input, const Quantiser& box) {
  Json trials = Json::array();
  for (const PageTrial& trial : input.trials) {
    trials.push_back({{"direction", to_json(trial.direction)},
                      {"nodes", box.encode_points(trial.nodes)},
                      {"push", encode_floats(trial.push.reshaped())}});
    if (trial.tools.cols() > 0) {
      trials.back()["tools"] = encode_floats(trial.tools.reshaped());
      if (!trial.exchanges.empty()) trials.back()["exchanges"] = trial.exchanges;
    }
    if (trial.sections.cols() > 0) {
      trials.back()["sections"] = encode_floats(trial.sections.reshaped());
    }
  }
  return trials;
}

Json insertion_json(const PageInsertion& insertion, const Quantiser& box) {
  Json shapes = Json::array();
  for (const simulate::Shape& shape : insertion.shapes) {
    shapes.push_back({{"insertion_mm", shape.insertion},
                      {"nodes", box.encode_points(shape.nodes)},
                      {"force_n", encode_floats(shape.contact_force)}});
    if (!shape.tools.empty()) shapes.back()["tools_mm"] = shape.tools;
    if (shape.sections.cols() > 0) {
      shapes.back()["sections"] = encode_floats(shape.sections.reshaped());
    }
  }
  std::vector<std::uint32_t> triangles;
  std::vector<float> forces;
  for (const simulate::TriangleForce& peak : insertion.peak_forces) {
    triangles.push_back(static_cast<std::uint32_t>(peak.triangle));
    forces.push_back(static_cast<float>(peak.force));
  }
  return {{"trial", insertion.trial},
          {"shapes", std::move(shapes)},
          {"wall_triangle", encode(triangles)},
          {"wall_force_n", encode(forces)}};
}

/// How points follow cross-sections: of each point how many it follows, which and with what
/// weights. The points are the surface's, the path's, access and target, in this order.
Json motion_weights_json(const PageInput& input) {
  std::vector<std::uint8_t> counts;
  std::vector<std::uint16_t> nodes;
  std::vector<float> weights;
  expects(input.chain->nodes() <= std::numeric_limits<std::uint16_t>::max());
  std::vector<simulate::SectionChain::Weight> found;
  const auto add = [&](const Vec3& point) {
    input.chain->find_weights(point, /*with_bend=*/false, found);
    expects(found.size() <= std::numeric_limits<std::uint8_t>::max());
    counts.push_back(static_cast<std::uint8_t>(found.size()));
    for (const simulate::SectionChain::Weight& weight : found) {
      nodes.push_back(static_cast<std::uint16_t>(weight.node));
      weights.push_back(static_cast<float>(weight.value));
    }
  };
  for (const auto& vertex : input.surface.vertices.colwise()) add(vertex);
  for (const auto& point : input.path.points.colwise()) add(point);
  add(input.access);
  add(input.target);
  return {{"counts", encode(counts)}, {"nodes", encode(nodes)}, {"weights", encode(weights)}};
}

Json scene_json(const PageInput& input) {
  const Quantiser box = fit_box(input);
  Json insertions = Json::array();
  for (const PageInsertion& insertion : input.insertions) {
    insertions.push_back(insertion_json(insertion, box));
  }
  Json scene;
  scene["schema"] = kPageSchema;
  scene["box"] = box.to_json();
  scene["access_mm"] = to_json(input.access);
  scene["target_mm"] = to_json(input.target);
  scene["target_radius_mm"] = input.target_radius;
  scene["wire_radius_mm"] = input.wire_radius;
  scene["surface"] = surface_json(input, box);
  scene["path"] = box.encode_points(input.path.points);
  scene["trials"] = trials_json(input, box);
  scene["insertions"] = std::move(insertions);
  if (input.chain) scene["motion"] = motion_weights_json(input);
  scene["panels"] = input.panels;
  scene["picture_png"] = base64(input.picture_png.data(), input.picture_png.size());
  return scene;
}

// Puts `text` in the place of the one mark of that name.
void fill(std::string& page, const std::string& mark, const std::string& text) {
  const std::size_t at = page.rfind(mark);
  expects(at != std::string::npos);
  page.replace(at, mark.size(), text);
}

/// Which stands in a block of its own.
Json without_timing(Json report) {
  report.erase("timing");
  return report;
}

std::string fill_template(const Json& report, const Json& scene, const Json& timing) {
  std::string page = page_template();
  // The report, which holds names of others' choosing, comes last: no mark is looked for in it.
  fill(page, "%WIREPLAN_TIMING%", embed_json(timing));
  fill(page, "%WIREPLAN_SCENE%", embed_json(scene));
  fill(page, "%WIREPLAN_REPORT%", embed_json(report));
  return page;
}

}  // namespace

PageTrial page_trial(const simulate::TrialResult& trial) {
  PageTrial kept;
  kept.nodes = trial.nodes.cast<float>();
  kept.push.resize(5, static_cast<Eigen::Index>(trial.pushes.size()));
  for (std::size_t k = 0; k < trial.pushes.size(); ++k) {
    const simulate::Push& push = trial.pushes[k];
    kept.push.col(static_cast<Eigen::Index>(k)) << static_cast<float>(push.insertion),
        static_cast<float>(push.push_force), static_cast<float>(push.tip_force),
        static_cast<float>(push.peak_contact_force), static_cast<float>(push.total_contact_force);
  }
  kept.sections = trial.sections.cast<float>();
  if (trial.tools.size() != 2) return kept;
  for (const auto& [from, name] : trial.tools[1].changes) kept.exchanges.push_back(from);
  kept.tools.resize(7, static_cast<Eigen::Index>(trial.pushes.size()));
  for (std::size_t k = 0; k < trial.pushes.size(); ++k) {
    const auto column = static_cast<Eigen::Index>(k);
    kept.tools(0, column) = static_cast<float>(trial.steps[k]);
    for (Eigen::Index i = 0; i < 2; ++i) {
      const simulate::ToolTrack& track = trial.tools[static_cast<std::size_t>(i)];
      kept.tools.col(column).segment<3>(1 + 3 * i) << static_cast<float>(track.insertion[k]),
          static_cast<float>(track.push_force[k]), static_cast<float>(track.tip_force[k]);
    }
  }
  return kept;
}

std::string page_template_sha256() { return hash_text(page_template()); }

std::string build_page(const Json& report, const PageInput& input) {
  expects(page_missing().empty() && input.trials.size() == report.at("trials").size() &&
          static_cast<Eigen::Index>(input.peak_force.size()) == input.surface.triangles.cols());
  return fill_template(without_timing(report), scene_json(input), report.at("timing"));
}

std::string with_report(std::string page, const Json& before, const Json& report) {
  fill(page, embed_json(without_timing(before)), embed_json(without_timing(report)));
  return page;
}

std::string build_overview_page(const Json& overview) {
  expects(page_missing().empty());
  return fill_template(overview, nullptr, nullptr);
}

std::string embed_json(const Json& value) {
  const std::string plain = value.dump(-1, ' ', /*ensure_ascii=*/true);
  std::string safe;
  safe.reserve(plain.size() + plain.size() / 64);
  for (const char c : plain) {
    switch (c) {
      case '<':
        safe += "\\u003c";
        break;
      case '>':
        safe += "\\u003e";
        break;
      case '&':
        safe += "\\u0026";
        break;
      default:
        safe += c;
    }
  }
  return safe;
}

std::string base64(const void* bytes, std::size_t count) {
  static constexpr const char* kDigits =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  const auto* byte = static_cast<const std::uint8_t*>(bytes);
  std::string text;
  text.reserve((count + 2) / 3 * 4);
  for (std::size_t k = 0; k < count; k += 3) {
    const std::size_t here = std::min<std::size_t>(3, count - k);
    std::uint32_t group = 0;
    for (std::size_t i = 0; i < 3; ++i) group = group << 8U | (i < here ? byte[k + i] : 0U);
    for (std::size_t i = 0; i < 4; ++i) {
      text += i <= here ? kDigits[group >> (18U - 6U * i) & 63U] : '=';
    }
  }
  return text;
}

}  // namespace wireplan::pipeline
