#include "simulate/wire/tool_stack.h"

#include <algorithm>
#include <cmath>

namespace wireplan::simulate {

namespace {

/// The section at an arc length from the tip, past the tip the first, and where it begins [mm].
struct SectionThere {
  const Section& section;
  double start = 0.0;
};

SectionThere section_at(const Wire& wire, double from_tip) {
  double start = 0.0;
  std::size_t k = 0;
  while (k + 1 < wire.sections.size() && from_tip > start + wire.sections[k].length) {
    start += wire.sections[k++].length;
  }
  return {wire.sections[k], start};
}

}  // namespace

ToolSpot look_at(const Wire& wire, double from_tip) {
  const auto [section, start] = section_at(wire, from_tip);
  ToolSpot local;
  local.there = from_tip > 0.0;
  local.EI = section.EI(std::clamp(from_tip - start, 0.0, section.length));
  local.GJ = section.twist_stiffness > 0.0 ? section.twist_stiffness : local.EI / 1.3;
  local.curvature = section.rest_curvature;
  return local;
}

namespace {

/// Energy of the tool's natural curve where it is held straight, behind the introducer, and the
/// compliance to torque there.
void add_lead(const Wire& wire, double insertion, double& stored, double& compliance) {
  double start = 0.0;
  for (const Section& section : wire.sections) {
    const double from = std::max(0.0, insertion - start), part = section.length - from;
    start += section.length;
    if (part <= 0.0) continue;
    compliance += section.twist_compliance(from, part);
    if (section.rest_curvature == 0.0) continue;
    const double EI =  // its mean, by Simpson's rule
        (section.EI(from) + 4.0 * section.EI(from + 0.5 * part) + section.EI(section.length)) / 6.0;
    stored += 0.5 * EI * part * section.rest_curvature * section.rest_curvature;
  }
}

constexpr double kNothing = 1e-12;  // of an edge: what rounding leaves of a part

/// Integrals over the nodes' hats, and what comes of them, in the memory of a composite.
class Builder {
 public:
  Builder(const std::vector<Tool>& tools, const std::vector<ToolPlace>& places, int elements,
          Composite& into)
      : tools_(tools),
        places_(places),
        n_(elements + 1),
        rod_(into.rod),
        terms_(into.terms),
        outside_(into.outside),
        axial_(into.axial),
        ends_(into.ends) {
    for (const ToolPlace& place : places) length_ = std::max(length_, place.insertion);
    h_ = length_ / elements;
    terms_.tool.clear();
    for (std::size_t i = 0; i < tools.size(); ++i) {
      if (!tools[i].wire.straight()) terms_.tool.push_back(static_cast<int>(i));
    }
    const int T = terms_.twists();
    rod_.bend.setZero(n_);
    rod_.mass.setZero(n_);
    axial_.setZero(n_);
    outside_.setZero(static_cast<Eigen::Index>(tools.size()), n_);
    terms_.rest.setZero(T, n_);
    terms_.twist.setZero(T, n_);
    terms_.mutual.setZero(T * (T - 1) / 2, n_);
    terms_.lead.setZero(T);
    terms_.roll.setZero(T);
    terms_.stored = 0.0;
  }

  void build() {
    find_ends();
    double from = 0.0;
    for (const double end : ends_) {
      integrate_stretch(from, end);
      from = end;
    }
    add_leads();
    finish_twist();
    finish_rod();
    for (int i = 0; i < n_; ++i) outside_.col(i) /= rod_.share[i];
  }

 private:
  /// A tool along a stretch that none of its sections ends in: EI is q, or q^4, which is linear in
  /// the place s.
  struct Along {
    bool there = false, cone = false;
    double q_0 = 0.0, q_s = 0.0;                          // at s = 0, and per length
    double EA = 0.0, GJ = 0.0;                            // 0: they follow from EI
    double EA_per_EI = 0.0, curvature = 0.0, mass = 0.0;  //                [1/mm^2, 1/mm, t/mm]

    double EI(double s) const {
      const double q = q_0 + q_s * s;
      return cone ? (q * q) * (q * q) : q;
    }
  };
  /// What a twisted tool's length counts with at a place.
  struct Curve {
    double per_GJ = 0.0;
    double turn = 0.0;                           // EI kappa / K                        [1/mm]
    double stored = 0.0;                         //                                        [N]
    std::array<double, kMostTools> mutual = {};  // with those inside it                   [N]
  };
  /// What a place's length counts with.
  struct Local {
    std::array<double, kMostTools> EI = {};
    std::array<Curve, kMostTools> curve;                // of the twisted ones
    double compliance = 0.0, per_EA = 0.0, mass = 0.0;  // 1/K, 1/EA
  };

  /// Ends of sections within the centreline, from the introducer on, and its own.
  void find_ends() {
    ends_.clear();
    for (std::size_t i = 0; i < tools_.size(); ++i) {
      double s = places_[i].insertion;
      for (const Section& section : tools_[i].wire.sections) {
        if (s > 0.0 && s < length_) ends_.push_back(s);
        s -= section.length;
      }
    }
    std::sort(ends_.begin(), ends_.end());
    ends_.push_back(length_);
  }

  /// Between ends of sections, edge by edge; where no tool tapers, whole edges at once.
  void integrate_stretch(double from, double to) {
    if (to - from <= kNothing * h_) return;  // of rounding; its middle may lie past a tip
    find_along(0.5 * (from + to));
    if (even_) look(0.5 * (from + to));
    for (int e = std::min(static_cast<int>(from / h_), n_ - 2); e + 1 < n_ && e * h_ < to; ++e) {
      const double end = e + 2 == n_ ? length_ : (e + 1) * h_;
      const int whole = static_cast<int>(to / h_) - e;
      if (even_ && from <= e * h_ && whole > 1) {
        add_edges(e, whole);
        e += whole - 1;
      } else {
        integrate_part(e, std::max(from, e * h_), std::min(to, end));
      }
    }
  }

  /// By the middle where no tool tapers, else by Gauss' rule.
  void integrate_part(int e, double from, double to) {
    const double part = to - from, middle = 0.5 * (from + to);
    if (part <= kNothing * h_) return;
    if (even_) {
      add_point(e, middle, part);
      return;
    }
    constexpr std::array<double, 3> kPoint = {-0.7745966692414834, 0.0, 0.7745966692414834};
    constexpr std::array<double, 3> kWeight = {5.0 / 18.0, 8.0 / 18.0, 5.0 / 18.0};
    for (std::size_t p = 0; p < 3; ++p) {
      const double s = middle + 0.5 * part * kPoint[p];
      look(s);
      add_point(e, s, kWeight[p] * part);
    }
  }

  /// The tools along the stretch about a place.
  void find_along(double s) {
    even_ = true;
    curved_ = false;
    outermost_ = -1;
    for (std::size_t i = 0; i < tools_.size(); ++i) {
      const Wire& wire = tools_[i].wire;
      const double insertion = places_[i].insertion;
      const auto [section, start] = section_at(wire, insertion - s);
      Along& tool = along_[i];
      tool = {.there = s < insertion,
              .cone = section.tapered() && section.taper == Taper::kCone,
              .EA = section.axial_stiffness,
              .GJ = section.twist_stiffness,
              .EA_per_EI = 4.0 / (wire.radius * wire.radius),
              .curvature = section.rest_curvature,
              .mass = section.mass_per_length};
      const auto q = [&](double EI) { return tool.cone ? std::sqrt(std::sqrt(EI)) : EI; };
      const double q_tip = q(section.bending_stiffness);
      tool.q_s = (q_tip - q(section.proximal_EI())) / section.length;
      if (!tool.there) tool.q_s = 0.0;  // what its tip has
      tool.q_0 = q_tip - tool.q_s * (insertion - start);
      if (!tool.there) continue;
      even_ = even_ && !section.tapered();
      curved_ = curved_ || tool.curvature != 0.0;
      if (outermost_ < 0) outermost_ = static_cast<Eigen::Index>(i);
    }
  }

  void look(double s) {
    double K = 0.0, EA = 0.0;
    local_.mass = 0.0;
    for (std::size_t i = 0; i < tools_.size(); ++i) {
      const Along& tool = along_[i];
      const double EI = local_.EI[i] = tool.EI(s);
      if (!tool.there) continue;
      K += EI;
      EA += tool.EA > 0.0 ? tool.EA : EI * tool.EA_per_EI;
      local_.mass += tool.mass;
    }
    local_.compliance = 1.0 / K;
    local_.per_EA = 1.0 / EA;
    for (int t = 0; t < terms_.twists(); ++t) {
      const std::size_t i = tool_of(t);
      local_.curve[static_cast<std::size_t>(t)].per_GJ =
          along_[i].GJ > 0.0 ? 1.0 / along_[i].GJ : 1.3 / local_.EI[i];
    }
    if (curved_) find_curves();
  }

  /// Of the twisted tools, once K is known.
  void find_curves() {
    const auto moment_of = [&](int t) {
      const Along& tool = along_[tool_of(t)];
      return tool.there ? local_.EI[tool_of(t)] * tool.curvature : 0.0;
    };
    for (int t = 0; t < terms_.twists(); ++t) {
      Curve& curve = local_.curve[static_cast<std::size_t>(t)];
      const double moment = moment_of(t);
      curve.turn = moment * local_.compliance;
      curve.stored = 0.5 * moment * (along_[tool_of(t)].curvature - curve.turn);
      for (int k = t + 1; k < terms_.twists(); ++k) {
        curve.mutual[static_cast<std::size_t>(k)] = -curve.turn * moment_of(k);
      }
    }
  }

  void add_point(int e, double s, double length) {
    const double w = s / h_ - e;
    add_share(e, (1.0 - w) * length);
    add_share(e + 1, w * length);
  }

  void add_share(int node, double w) {
    rod_.bend[node] += w * local_.compliance;
    axial_[node] += w * local_.per_EA;
    rod_.mass[node] += w * local_.mass;
    outside_(outermost_, node) += w;
    for (int t = 0; t < terms_.twists(); ++t) {
      terms_.twist(t, node) += w * local_.curve[static_cast<std::size_t>(t)].per_GJ;
    }
    if (curved_) add_curves(node, w);
  }

  /// So many whole edges on, all alike.
  void add_edges(int e, int count) {
    const double half = 0.5 * h_;
    for (const int first : {e, e + 1}) {
      rod_.bend.segment(first, count).array() += half * local_.compliance;
      axial_.segment(first, count).array() += half * local_.per_EA;
      rod_.mass.segment(first, count).array() += half * local_.mass;
      outside_.row(outermost_).segment(first, count).array() += half;
      for (int t = 0; t < terms_.twists(); ++t) {
        terms_.twist.row(t).segment(first, count).array() +=
            half * local_.curve[static_cast<std::size_t>(t)].per_GJ;
      }
      for (int k = 0; curved_ && k < count; ++k) add_curves(first + k, half);
    }
  }

  void add_curves(int node, double w) {
    for (int t = 0; t < terms_.twists(); ++t) {
      const Curve& curve = local_.curve[static_cast<std::size_t>(t)];
      terms_.rest(t, node) += w * curve.turn;
      terms_.stored += w * curve.stored;
      for (int k = t + 1; k < terms_.twists(); ++k) {
        terms_.mutual(ToolTerms::pair(t, k), node) += w * curve.mutual[static_cast<std::size_t>(k)];
      }
    }
  }

  std::size_t tool_of(int t) const {
    return static_cast<std::size_t>(terms_.tool[static_cast<std::size_t>(t)]);
  }

  void add_leads() {
    // No spring is infinitely stiff: the lead has so much of the part in front of it too [mm].
    constexpr double kLeast = 2e-5;
    for (int t = 0; t < terms_.twists(); ++t) {
      const std::size_t i = tool_of(t);
      const double insertion = places_[i].insertion;
      double compliance = kLeast / look_at(tools_[i].wire, insertion).GJ;
      terms_.twist(t, 0) -= compliance;
      add_lead(tools_[i].wire, insertion, terms_.stored, compliance);
      terms_.lead[t] = 1.0 / compliance;
      terms_.roll[t] = places_[i].roll;
    }
  }

  /// Twist reaches to the ends, as that of one wire (build_rod).
  void finish_twist() {
    Eigen::MatrixXd& twist = terms_.twist;  // so far integrals of w/GJ
    twist.col(1) += twist.col(0);
    twist.col(n_ - 2) += twist.col(n_ - 1);
    twist.col(0).setZero();
    twist.col(n_ - 1).setZero();
    for (int i = 1; i + 1 < n_; ++i) twist.col(i) = twist.col(i).cwiseInverse();
  }

  void finish_rod() {
    Rod& rod = rod_;
    rod.radius = 0.0;
    for (const Tool& tool : tools_) rod.radius = std::max(rod.radius, tool.wire.radius);
    rod.twisted = terms_.twists() > 0;
    rod.rest_length.setConstant(n_ - 1, h_);
    rod.per_length.setConstant(n_ - 1, 1.0 / h_);
    rod.bend = rod.bend.cwiseInverse();  // so far integrals of w/K
    rod.proximal_bend = rod.bend[0];
    rod.distal_bend = rod.bend[n_ - 1];
    rod.bend[0] = rod.bend[n_ - 1] = 0.0;
    rod.strip.setZero(n_);
    rod.twist.setZero(n_);
    rod.rest_angle.setZero(n_);
    rod.share.setConstant(n_, h_);
    rod.share[0] = rod.share[n_ - 1] = 0.5 * h_;
    rod.thinner.setZero(n_);
    for (int i = 0; i < n_; ++i) {
      for (std::size_t k = 0; k < tools_.size(); ++k) {
        const double less = rod.radius - tools_[k].wire.radius;
        rod.thinner[i] += less * outside_(static_cast<Eigen::Index>(k), i) / rod.share[i];
      }
    }
    // An edge stretches as the hats of its ends do: it must not jump either.
    rod.stretch.resize(n_ - 1);
    for (int e = 0; e + 1 < n_; ++e) {
      rod.stretch[e] = 2.0 / (axial_[e] / rod.share[e] + axial_[e + 1] / rod.share[e + 1]);
    }
    rod.tip_distance.setLinSpaced(n_, length_, 0.0);
  }

  const std::vector<Tool>& tools_;
  const std::vector<ToolPlace>& places_;
  const int n_;  // nodes
  double length_ = 0.0, h_ = 0.0;
  Rod& rod_;
  ToolTerms& terms_;
  Eigen::MatrixXd& outside_;   // (tools, n) so far of w where a tool is the outermost
  Eigen::VectorXd& axial_;     // (n) integrals of w/EA
  std::vector<double>& ends_;  // of stretches
  // Of the stretch under way:
  std::array<Along, kMostTools> along_;
  Eigen::Index outermost_ = 0;          // tool
  bool even_ = false, curved_ = false;  // no tool tapers; any has a curve
  Local local_;                         // the latest place; of an even stretch any
};

}  // namespace

void build_composite(const std::vector<Tool>& tools, const std::vector<ToolPlace>& places,
                     int elements, Composite& composite) {
  expects(!tools.empty() && tools.size() <= kMostTools && places.size() == tools.size());
  expects(elements >= 2);
  double longest = 0.0;
  for (std::size_t i = 0; i < tools.size(); ++i) {
    expects(tools[i].wire.round() && places[i].insertion >= 0.0);
    expects(places[i].insertion <= tools[i].wire.length() * (1.0 + 1e-12));
    longest = std::max(longest, places[i].insertion);
  }
  expects(longest > 0.0);
  Builder(tools, places, elements, composite).build();
}

Composite build_composite(const std::vector<Tool>& tools, const std::vector<ToolPlace>& places,
                          int elements) {
  Composite composite;
  build_composite(tools, places, elements, composite);
  return composite;
}

}  // namespace wireplan::simulate
