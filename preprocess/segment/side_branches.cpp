#include "preprocess/segment/side_branches.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <numbers>
#include <queue>
#include <utility>

#include "preprocess/segment/segment_close.h"

namespace wireplan::preprocess {
namespace {

// Of the artery's contrast: what touches a branch, or its mouth, at less of it may not at more.
constexpr double kBranchParts[] = {0.65, 0.55, 0.45};
constexpr double kNoises = 5.0;        // that a voxel of it stands out by
constexpr double kMostBrighter = 0.2;  // of the artery's contrast
constexpr double kLeastMm = 12.0, kLeastRadii = 6.0, kMostMm = 80.0;  // of its length
constexpr double kLeastVoxels = 3.0;                                  // of its cross-section
constexpr double kOnePiece = 0.85;                                    // of a section's voxels
constexpr double kSteady = 2.2;    // by which sections may differ from those before
constexpr double kOstium = 0.3;    // least contact with the artery, of the cross-section
constexpr double kLeavesMm = 5.0;  // from the contact, behind which the artery is far
constexpr double kOfArtery = 0.7, kAlwaysMm = 2.0;  // of the artery's radius; what always is
constexpr double kAlikePart = 0.75;                 // of the artery's contrast: as bright as it
constexpr double kAlikeMm = 2.5;                    // what then always is
constexpr int kMostRounds = 3;                      // of branches that leave branches
constexpr double kSectionVoxels = 2.0;              // how long a section is, at least
constexpr double kOwnPart = 0.5;                    // of its own contrast, where a branch ends

/// Voxels of one distance from the contact.
struct Section {
  std::vector<std::size_t> voxels;
  double sum = 0.0;      // of the volume's values                                         [HU]
  bool returns = false;  // one lies at the artery again
};

/// Voxels beside the artery that may be where a branch begins.
struct Contact {
  std::vector<std::size_t> voxels;
  double level = 0.0;   // of the artery there                                             [HU]
  double radius = 0.0;  // of the artery there                                             [mm]
};

/// How long a section is [mm].
double section_length(const Grid& grid) {
  return std::max(kSectionVoxels * std::cbrt(grid.spacing.prod()), grid.spacing.maxCoeff());
}

double mean_voxels(const std::vector<Section>& sections) {
  double sum = 0.0;
  for (const Section& section : sections) sum += static_cast<double>(section.voxels.size());
  return sum / std::max(1.0, static_cast<double>(sections.size()));
}

/// Voxels of a cross-section, in the mean.
double voxels_across(const Grid& grid, const std::vector<Section>& sections) {
  return mean_voxels(sections) * std::cbrt(grid.spacing.prod()) / section_length(grid);
}

/// By how much a voxel stands out of the noise that smoothing leaves [HU].
double least_contrast(const LumenField& field) {
  const double left =
      field.smoothing_mm > 0.0 ? smoothed_noise(field.grid, field.smoothing_mm) : 1.0;
  return kNoises * field.noise * left;
}

/// What a branch with this part of the contrast of an artery of this level has at least [HU].
double least_value(const LumenField& field, double part, double contrast, double level) {
  return field.surroundings + std::max(part * (level - field.surroundings), contrast);
}

/// Looks for a branch at one contact after the other.
class BranchSearch {
 public:
  BranchSearch(const LumenField& field, const Labels& artery, double part)
      : field_(field),
        artery_(artery),
        part_(part),
        voxel_(std::cbrt(field.grid.spacing.prod())),
        section_mm_(section_length(field.grid)),
        least_contrast_(least_contrast(field)),
        distance_(artery.size(), std::numeric_limits<double>::infinity()),
        before_(artery.size(), 0),
        open_(artery.size(), 0) {}

  /// The sections of the branch at this contact; empty where there is none. Where what lies at the
  /// contact falls into pieces next to the artery, one of them may be the branch.
  std::vector<Section> follow(const Contact& contact) {
    std::vector<Section> sections = follow_steady(contact);
    if (!is_branch(contact, sections)) sections = follow_pieces(contact, sections);
    forget();
    touched_.clear();
    return sections;
  }

 private:
  using Visit = std::pair<double, std::size_t>;  // distance [mm], voxel

  /// Whether the sections are long, wide and narrow enough for a branch at the contact.
  bool is_branch(const Contact& contact, const std::vector<Section>& sections) const {
    const auto count = static_cast<double>(sections.size());
    const double across = voxels_across(field_.grid, sections);
    const double radius = voxel_ * std::sqrt(across / std::numbers::pi);
    return across >= kLeastVoxels &&
           count * section_mm_ >= std::max(kLeastMm, kLeastRadii * radius) &&
           static_cast<double>(contact.voxels.size()) >= kOstium * across &&
           radius <= std::max(is_alike(contact, sections) ? kAlikeMm : kAlwaysMm,
                              kOfArtery * contact.radius);
  }

  /// Whether the sections are nearly as bright as the artery.
  bool is_alike(const Contact& contact, const std::vector<Section>& sections) const {
    double sum = 0.0, voxels = 0.0;
    for (const Section& section : sections) {
      sum += section.sum;
      voxels += static_cast<double>(section.voxels.size());
    }
    return sum - voxels * field_.surroundings >=
           kAlikePart * voxels * (contact.level - field_.surroundings);
  }

  /// The first of the pieces, the largest first, that a branch begins in: its sections, and before
  /// them the voxels that lead there from the contact. What was visited on the way to the pieces is
  /// closed.
  std::vector<Section> follow_pieces(const Contact& contact, const std::vector<Section>& visited) {
    const std::vector<std::vector<std::size_t>> pieces = std::move(pieces_);
    for (const std::vector<std::size_t>& piece : pieces) {
      if (static_cast<double>(piece.size()) < kLeastVoxels) break;
      Section stem;
      for (const std::size_t n : piece) open_[n] = 1;
      for (std::size_t n : piece) {
        for (n = before_[n]; open_[n] == 0; n = before_[n]) {
          open_[n] = 1;
          stem.voxels.push_back(n);
          stem.sum += static_cast<double>(field_.raw[n]);
          if (before_[n] == n) break;
        }
      }
      forget();
      for (const Section& section : visited) close(section.voxels);
      for (const std::vector<std::size_t>& other : pieces) close(other);
      for (const std::size_t n : piece) distance_[n] = std::numeric_limits<double>::infinity();
      const Contact begin{.voxels = piece, .level = contact.level, .radius = contact.radius};
      std::vector<Section> sections = follow_steady(begin);
      if (!is_branch(begin, sections) || !is_alike(begin, sections)) continue;
      sections.insert(sections.begin(), std::move(stem));
      return sections;
    }
    return {};
  }

  /// As before anything was visited.
  void forget() {
    for (const std::size_t n : touched_) {
      distance_[n] = std::numeric_limits<double>::infinity();
      open_[n] = 0;
    }
  }

  void close(const std::vector<std::size_t>& voxels) {
    for (const std::size_t n : voxels) distance_[n] = 0.0;
  }

  std::vector<Section> follow_steady(const Contact& contact) {
    pieces_.clear();
    const double least = least_value(field_, part_, least_contrast_, contact.level);
    std::priority_queue<Visit, std::vector<Visit>, std::greater<>> visits;
    const auto reach = [&](std::size_t n, double distance, std::size_t from) {
      if (distance >= distance_[n]) return;
      if (std::isinf(distance_[n])) touched_.push_back(n);
      distance_[n] = distance;
      before_[n] = static_cast<std::uint32_t>(from);
      visits.push({distance, n});
    };
    for (const std::size_t n : contact.voxels) reach(n, 0.0, n);
    std::vector<Section> sections;
    Section open;
    while (!visits.empty()) {
      const double distance = visits.top().first;
      const std::size_t n = visits.top().second;
      visits.pop();
      if (distance > distance_[n]) continue;
      if (!open.voxels.empty() &&
          distance >= static_cast<double>(sections.size() + 1) * section_mm_) {
        if (open.returns) return {};
        if (!goes_on(open, contact.level, sections)) return sections;
        sections.push_back(std::exchange(open, {}));
        if (distance > kMostMm) return sections;
      }
      open_[n] = 1;
      open.voxels.push_back(n);
      open.sum += static_cast<double>(field_.raw[n]);
      for_each_neighbour(field_.grid, n, [&](std::size_t m, const Voxel& step) {
        if (artery_[m] != 0) {
          open.returns = open.returns || distance > kLeavesMm;
          return;
        }
        const auto value = static_cast<double>(field_.values[m]);
        if (value < least || value > field_.upper) return;
        const Vec3 by = Vec3(step[0], step[1], step[2]).cwiseProduct(field_.grid.spacing);
        reach(m, distance + by.norm(), n);
      });
    }
    if (open.returns) return {};
    if (!open.voxels.empty() && goes_on(open, contact.level, sections)) {
      sections.push_back(std::move(open));
    }
    return sections;
  }

  /// Whether the section belongs to the branch that the sections before it are of.
  bool goes_on(const Section& section, double level, const std::vector<Section>& before) {
    const auto voxels = static_cast<double>(section.voxels.size());
    const double most = level + kMostBrighter * (level - field_.surroundings);
    if (section.sum > voxels * most) return false;
    if (!before.empty() && (voxels > kSteady * mean_voxels(before) ||
                            voxels * kSteady < kLeastVoxels * section_mm_ / voxel_)) {
      return false;
    }
    std::vector<std::vector<std::size_t>> pieces = pieces_of(section);
    if (static_cast<double>(pieces.front().size()) >= kOnePiece * voxels) return true;
    if (static_cast<double>(before.size()) * section_mm_ < kLeavesMm) pieces_ = std::move(pieces);
    return false;
  }

  /// Pieces of the open section, the largest first.
  std::vector<std::vector<std::size_t>> pieces_of(const Section& section) {
    std::vector<std::vector<std::size_t>> pieces;
    for (const std::size_t start : section.voxels) {
      if (open_[start] == 0) continue;
      std::vector<std::size_t> queue = {start};
      open_[start] = 0;
      for (std::size_t next = 0; next < queue.size(); ++next) {
        for_each_neighbour(field_.grid, queue[next], [&](std::size_t m, const Voxel&) {
          if (open_[m] == 0) return;
          open_[m] = 0;
          queue.push_back(m);
        });
      }
      pieces.push_back(std::move(queue));
    }
    std::stable_sort(pieces.begin(), pieces.end(),
                     [](const auto& a, const auto& b) { return a.size() > b.size(); });
    return pieces;
  }

  const LumenField& field_;
  const Labels& artery_;
  double part_;                        // of the artery's contrast, that a branch has
  double voxel_, section_mm_;          //                                                       [mm]
  double least_contrast_;              //                                                       [HU]
  std::vector<double> distance_;       // in the branch, from the contact                       [mm]
  std::vector<std::uint32_t> before_;  // the voxel from which each was reached; itself at contacts
  Labels open_;                        // 1 in the section that is being visited
  std::vector<std::vector<std::size_t>>
      pieces_;  // of a section next to the contact, that it ends in
  std::vector<std::size_t> touched_;
};

/// Whether what was followed is no tube but a film, as the blurred rim of a bone: wide as its
/// sections are, hardly a voxel has others on both sides along the axes whose voxels are fine.
bool is_film(const Grid& grid, const std::vector<Section>& sections) {
  constexpr double kLeastAcross = 20.0, kInner = 0.1;  // voxels; of all
  if (voxels_across(grid, sections) < kLeastAcross) return false;
  std::vector<std::size_t> voxels;
  for (const Section& section : sections) {
    voxels.insert(voxels.end(), section.voxels.begin(), section.voxels.end());
  }
  std::sort(voxels.begin(), voxels.end());
  const std::array<std::size_t, 3> stride = {1, grid.index(0, 1, 0), grid.index(0, 0, 1)};
  const auto is_inner = [&](std::size_t n) {
    for (int axis = 0; axis < 3; ++axis) {
      if (grid.spacing[axis] > kFineMm) continue;
      const std::size_t by = stride[static_cast<std::size_t>(axis)];
      if (!std::binary_search(voxels.begin(), voxels.end(), n + by) ||
          !std::binary_search(voxels.begin(), voxels.end(), n - by)) {
        return false;
      }
    }
    return true;
  };
  const auto inner = std::count_if(voxels.begin(), voxels.end(), is_inner);
  return static_cast<double>(inner) < kInner * static_cast<double>(voxels.size());
}

/// Inscribed radius of the artery [mm] in its middle beside voxel n, uphill from there.
double radius_beside(const Grid& grid, const std::vector<float>& depth, std::size_t n) {
  for (bool climbs = true; climbs;) {
    std::size_t best = n;
    for_each_neighbour(grid, n, [&](std::size_t m, const Voxel&) {
      if (depth[m] > depth[best]) best = m;
    });
    climbs = best != n;
    n = best;
  }
  return static_cast<double>(depth[n]);
}

/// All contacts with what has this part of the contrast, those of the lower voxels first.
std::vector<Contact> find_contacts(const LumenField& field, const std::vector<float>& level,
                                   const Labels& artery, double part) {
  const Grid& grid = field.grid;
  std::vector<float> beside(artery.size(), 0.0F);  // level of the artery that a voxel touches
  for (std::size_t n = 0; n < artery.size(); ++n) {
    if (artery[n] == 0) continue;
    for_each_face_neighbour(grid, n, [&](std::size_t m) {
      if (artery[m] == 0) beside[m] = std::max(beside[m], level[n]);
    });
  }
  const double contrast = least_contrast(field);
  for (std::size_t n = 0; n < artery.size(); ++n) {
    if (beside[n] == 0.0F) continue;
    const auto value = static_cast<double>(field.values[n]);
    if (value < least_value(field, part, contrast, static_cast<double>(beside[n])) ||
        value > field.upper) {
      beside[n] = 0.0F;
    }
  }
  const std::vector<float> depth = measure_depth(grid, artery);
  std::vector<Contact> contacts;
  for (std::size_t n = 0; n < artery.size(); ++n) {
    if (beside[n] == 0.0F) continue;
    Contact contact;
    const auto take = [&](std::size_t m) {
      contact.voxels.push_back(m);
      contact.level += static_cast<double>(beside[m]);
      contact.radius = std::max(contact.radius, radius_beside(grid, depth, m));
      beside[m] = 0.0F;
    };
    take(n);
    for (std::size_t next = 0; next < contact.voxels.size(); ++next) {
      for_each_neighbour(grid, contact.voxels[next], [&](std::size_t m, const Voxel&) {
        if (beside[m] != 0.0F) take(m);
      });
    }
    contact.level /= static_cast<double>(contact.voxels.size());
    contacts.push_back(std::move(contact));
  }
  return contacts;
}

/// Labels a branch as artery, and beside it what has half of its contrast.
Leak add_branch(const LumenField& field, const Contact& contact,
                const std::vector<Section>& sections, std::vector<float>& level, Labels& artery,
                Labels& other) {
  const Grid& grid = field.grid;
  Leak added;
  for (const std::size_t n : contact.voxels) added.place += center_of(grid, n);
  added.place /= static_cast<double>(contact.voxels.size());
  std::vector<std::size_t> voxels;
  for (const Section& section : sections) {
    added.mean_hu += section.sum;
    voxels.insert(voxels.end(), section.voxels.begin(), section.voxels.end());
  }
  added.mean_hu /= static_cast<double>(voxels.size());
  const double edge = field.surroundings + kOwnPart * (added.mean_hu - field.surroundings);
  const auto take = [&](std::size_t n) {
    artery[n] = 1;
    other[n] = 0;
    level[n] = static_cast<float>(added.mean_hu);
  };
  for (const std::size_t n : voxels) take(n);
  const std::size_t inside = voxels.size();
  for (std::size_t k = 0; k < inside; ++k) {
    for_each_face_neighbour(grid, voxels[k], [&](std::size_t m) {
      const auto value = static_cast<double>(field.values[m]);
      if (artery[m] != 0 || value < edge || value > field.upper) return;
      take(m);
      voxels.push_back(m);
    });
  }
  added.volume_mm3 = static_cast<double>(voxels.size()) * grid.spacing.prod();
  added.radius_mm = std::sqrt(added.volume_mm3 / std::numbers::pi / section_length(grid) /
                              static_cast<double>(sections.size()));
  return added;
}

/// One round at this part of the contrast; those that leave what it adds are for the next.
void add_branches(const LumenField& field, double part, std::vector<float>& level, Labels& artery,
                  Labels& other, std::vector<Leak>& added) {
  BranchSearch search(field, artery, part);
  for (const Contact& contact : find_contacts(field, level, artery, part)) {
    const bool taken = std::any_of(contact.voxels.begin(), contact.voxels.end(),
                                   [&](std::size_t n) { return artery[n] != 0; });
    if (taken) continue;
    const std::vector<Section> sections = search.follow(contact);
    if (sections.empty() || is_film(field.grid, sections)) continue;
    added.push_back(add_branch(field, contact, sections, level, artery, other));
  }
}

}  // namespace

std::vector<Leak> add_side_branches(const LumenField& field, std::vector<float>& level,
                                    Labels& artery, Labels& other) {
  std::vector<Leak> added;
  for (const double part : kBranchParts) {
    for (int round = 0; round < kMostRounds; ++round) {
      const std::size_t before = added.size();
      add_branches(field, part, level, artery, other, added);
      if (added.size() == before) break;
    }
  }
  std::stable_sort(added.begin(), added.end(),
                   [](const Leak& a, const Leak& b) { return a.volume_mm3 > b.volume_mm3; });
  return added;
}

}  // namespace wireplan::preprocess
