#include "simulate/wire/tool_stack.h"

#include <algorithm>
#include <cmath>

namespace wireplan::simulate {

ToolSpot look_at(const Wire& wire, double from_tip) {
  double start = 0.0;
  std::size_t k = 0;
  while (k + 1 < wire.sections.size() && from_tip > start + wire.sections[k].length) {
    start += wire.sections[k++].length;
  }
  const Section& section = wire.sections[k];
  const double from = std::clamp(from_tip - start, 0.0, section.length);
  ToolSpot local;
  local.there = from_tip > 0.0;
  local.tapers = section.tapered();
  local.EI = section.EI(from);
  local.GJ = section.twist_stiffness > 0.0 ? section.twist_stiffness : local.EI / 1.3;
  local.EA = section.axial_stiffness > 0.0 ? section.axial_stiffness
                                           : 4.0 * local.EI / (wire.radius * wire.radius);
  local.curvature = section.rest_curvature;
  local.mass = section.mass_per_length;
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
    for (int e = 0; e + 1 < n_; ++e) integrate_edge(e);
    add_leads();
    finish_twist();
    finish_rod();
    for (int i = 0; i < n_; ++i) outside_.col(i) /= rod_.share[i];
  }

 private:
  /// A twisted tool at a place, and what its length counts with.
  struct Curve {
    double per_GJ = 0.0;
    double turn = 0.0;                           // EI kappa / K                       [1/mm]
    double stored = 0.0;                         //                                     [N]
    std::array<double, kMostTools> mutual = {};  // with those inside it                [N]
  };
  /// The tools at a place, and what its length counts with.
  struct Local {
    std::array<ToolSpot, kMostTools> at;
    std::array<Curve, kMostTools> curve;                // of the twisted ones
    double compliance = 0.0, per_EA = 0.0, mass = 0.0;  // 1/K, 1/EA
    Eigen::Index outermost = 0;
    bool even = false;    // the same up to the next end of a section
    bool curved = false;  // any tool, there
  };

  /// Ends of sections within the centreline, from the introducer on.
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
  }

  /// Part by part of the edge between ends of sections.
  void integrate_edge(int e) {
    const double end = e + 2 == n_ ? length_ : (e + 1) * h_;
    double from = e * h_;
    while (next_ < ends_.size() && ends_[next_] < end) {
      integrate_part(e, from, ends_[next_]);
      from = std::max(from, ends_[next_++]);
      known_ = false;
    }
    integrate_part(e, from, end);
  }

  /// By the middle where no tool tapers, else by Gauss' rule.
  void integrate_part(int e, double from, double to) {
    const double part = to - from, middle = 0.5 * (from + to);
    if (part <= 1e-12 * h_) return;  // of rounding; none of its points may lie past a tip
    if (!known_) look(middle);
    known_ = true;
    if (local_.even) {
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

  void look(double s) {
    double K = 0.0, EA = 0.0;
    local_.mass = 0.0;
    local_.even = true;
    for (std::size_t i = 0; i < tools_.size(); ++i) {
      ToolSpot& spot = local_.at[i];
      spot = look_at(tools_[i].wire, places_[i].insertion - s);
      if (!spot.there) continue;
      if (K == 0.0) local_.outermost = static_cast<Eigen::Index>(i);
      K += spot.EI;
      EA += spot.EA;
      local_.mass += spot.mass;
      local_.even = local_.even && !spot.tapers;
    }
    local_.compliance = 1.0 / K;
    local_.per_EA = 1.0 / EA;
    find_curves();
  }

  /// Of the twisted tools, once K is known.
  void find_curves() {
    local_.curved = false;
    for (int t = 0; t < terms_.twists(); ++t) {
      const ToolSpot& here = spot_of(t);
      Curve& curve = local_.curve[static_cast<std::size_t>(t)];
      curve = {.per_GJ = 1.0 / here.GJ};
      if (!here.there || here.curvature == 0.0) continue;
      local_.curved = true;
      const double moment = here.EI * here.curvature;
      curve.turn = moment * local_.compliance;
      curve.stored = 0.5 * moment * (here.curvature - curve.turn);
      for (int k = t + 1; k < terms_.twists(); ++k) {
        const ToolSpot& other = spot_of(k);
        if (!other.there) continue;
        curve.mutual[static_cast<std::size_t>(k)] = -curve.turn * other.EI * other.curvature;
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
    outside_(local_.outermost, node) += w;
    for (int t = 0; t < terms_.twists(); ++t) {
      terms_.twist(t, node) += w * local_.curve[static_cast<std::size_t>(t)].per_GJ;
    }
    if (local_.curved) add_curves(node, w);
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

  const ToolSpot& spot_of(int t) const {
    return local_.at[static_cast<std::size_t>(terms_.tool[static_cast<std::size_t>(t)])];
  }

  void add_leads() {
    // No spring is infinitely stiff: the lead has so much of the part in front of it too [mm].
    constexpr double kLeast = 2e-5;
    for (int t = 0; t < terms_.twists(); ++t) {
      const auto i = static_cast<std::size_t>(terms_.tool[static_cast<std::size_t>(t)]);
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
  std::vector<double>& ends_;  // of sections, see find_ends()
  std::size_t next_ = 0;       // of them
  Local local_;
  bool known_ = false;  // it is that of the part between ends under way
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
