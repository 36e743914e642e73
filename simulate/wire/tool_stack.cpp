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

/// Integrals over the nodes' hats, and what comes of them.
class Builder {
 public:
  Builder(const std::vector<Tool>& tools, const std::vector<ToolPlace>& places, int elements)
      : tools_(tools), places_(places), n_(elements + 1) {
    for (const ToolPlace& place : places) length_ = std::max(length_, place.insertion);
    h_ = length_ / elements;
    for (std::size_t i = 0; i < tools.size(); ++i) {
      if (!tools[i].wire.straight()) terms_.tool.push_back(static_cast<int>(i));
    }
    const int T = terms_.twists();
    compliance_ = axial_ = mass_ = Eigen::VectorXd::Zero(n_);
    outside_.setZero(static_cast<Eigen::Index>(tools.size()), n_);
    torsional_ = terms_.rest = terms_.twist = Eigen::MatrixXd::Zero(T, n_);
    terms_.mutual = Eigen::MatrixXd::Zero(T * (T - 1) / 2, n_);
    terms_.lead = terms_.roll = Eigen::VectorXd::Zero(T);
  }

  Composite build() {
    for (int e = 0; e + 1 < n_; ++e) integrate_edge(e);
    add_leads();
    finish_twist();
    const Rod rod = make_rod();
    return {rod, terms_, outside_ * rod.share.cwiseInverse().asDiagonal()};
  }

 private:
  /// Gauss' rule on each part of the edge between ends of sections: exact where they do not taper.
  void integrate_edge(int e) {
    const double start = e * h_, end = e + 2 == n_ ? length_ : (e + 1) * h_;
    std::vector<double> ends = {start, end};
    for (std::size_t i = 0; i < tools_.size(); ++i) {
      double s = places_[i].insertion;
      for (const Section& section : tools_[i].wire.sections) {
        if (s > start && s < end) ends.push_back(s);
        s -= section.length;
      }
    }
    std::sort(ends.begin(), ends.end());
    constexpr std::array<double, 3> kPoint = {-0.7745966692414834, 0.0, 0.7745966692414834};
    constexpr std::array<double, 3> kWeight = {5.0 / 18.0, 8.0 / 18.0, 5.0 / 18.0};
    for (std::size_t k = 0; k + 1 < ends.size(); ++k) {
      const double part = ends[k + 1] - ends[k], middle = 0.5 * (ends[k] + ends[k + 1]);
      if (part <= 1e-12 * h_) continue;  // of rounding; none of its points may lie past a tip
      for (std::size_t p = 0; p < 3; ++p) {
        const double s = middle + 0.5 * part * kPoint[p], w = s / h_ - e;
        add_point(s, kWeight[p] * part, {Share{e, 1.0 - w}, Share{e + 1, w}});
      }
    }
  }

  struct Share {
    int node;
    double weight;
  };

  void add_point(double s, double length, const std::array<Share, 2>& shares) {
    std::array<ToolSpot, kMostTools> local;
    double K = 0.0, EA = 0.0, mass = 0.0;
    Eigen::Index outermost = 0;
    for (std::size_t i = 0; i < tools_.size(); ++i) {
      local[i] = look_at(tools_[i].wire, places_[i].insertion - s);
      if (!local[i].there) continue;
      if (K == 0.0) outermost = static_cast<Eigen::Index>(i);
      K += local[i].EI;
      EA += local[i].EA;
      mass += local[i].mass;
    }
    for (const Share& share : shares) {
      const double w = share.weight * length;
      compliance_[share.node] += w / K;
      axial_[share.node] += w / EA;
      mass_[share.node] += w * mass;
      outside_(outermost, share.node) += w;
      for (int t = 0; t < terms_.twists(); ++t) add_curve(t, share.node, w, K, local);
    }
  }

  void add_curve(int t, int node, double w, double K,
                 const std::array<ToolSpot, kMostTools>& local) {
    const auto at = [&](int row) -> const ToolSpot& {
      return local[static_cast<std::size_t>(terms_.tool[static_cast<std::size_t>(row)])];
    };
    const ToolSpot& here = at(t);
    torsional_(t, node) += w / here.GJ;
    if (!here.there) return;
    const double moment = here.EI * here.curvature;
    terms_.rest(t, node) += w * moment / K;
    terms_.stored += 0.5 * w * moment * (here.curvature - moment / K);
    for (int k = t + 1; k < terms_.twists(); ++k) {
      if (!at(k).there) continue;
      terms_.mutual(ToolTerms::pair(t, k), node) -= w * moment * at(k).EI * at(k).curvature / K;
    }
  }

  void add_leads() {
    // No spring is infinitely stiff: the lead has so much of the part in front of it too [mm].
    constexpr double kLeast = 2e-5;
    for (int t = 0; t < terms_.twists(); ++t) {
      const auto i = static_cast<std::size_t>(terms_.tool[static_cast<std::size_t>(t)]);
      const double insertion = places_[i].insertion;
      double compliance = kLeast / look_at(tools_[i].wire, insertion).GJ;
      torsional_(t, 0) -= compliance;
      add_lead(tools_[i].wire, insertion, terms_.stored, compliance);
      terms_.lead[t] = 1.0 / compliance;
      terms_.roll[t] = places_[i].roll;
    }
  }

  /// Twist reaches to the ends, as that of one wire (build_rod).
  void finish_twist() {
    for (int i = 1; i + 1 < n_; ++i) {
      Eigen::VectorXd sum = torsional_.col(i);
      if (i == 1) sum += torsional_.col(0);
      if (i == n_ - 2) sum += torsional_.col(n_ - 1);
      terms_.twist.col(i) = sum.cwiseInverse();
    }
  }

  Rod make_rod() const {
    Rod rod;
    for (const Tool& tool : tools_) rod.radius = std::max(rod.radius, tool.wire.radius);
    rod.twisted = terms_.twists() > 0;
    rod.rest_length = Eigen::VectorXd::Constant(n_ - 1, h_);
    rod.per_length = rod.rest_length.cwiseInverse();
    rod.bend = compliance_.cwiseInverse();
    rod.proximal_bend = rod.bend[0];
    rod.distal_bend = rod.bend[n_ - 1];
    rod.bend[0] = rod.bend[n_ - 1] = 0.0;
    rod.strip = rod.twist = rod.rest_angle = Eigen::VectorXd::Zero(n_);
    rod.share = Eigen::VectorXd::Constant(n_, h_);
    rod.share[0] = rod.share[n_ - 1] = 0.5 * h_;
    rod.mass = mass_;
    rod.thinner.setZero(n_);
    for (std::size_t i = 0; i < tools_.size(); ++i) {
      const double less = rod.radius - tools_[i].wire.radius;
      rod.thinner +=
          less * outside_.row(static_cast<Eigen::Index>(i)).transpose().cwiseQuotient(rod.share);
    }
    // An edge stretches as the hats of its ends do: it must not jump either.
    rod.stretch.resize(n_ - 1);
    for (int e = 0; e + 1 < n_; ++e) {
      rod.stretch[e] = 2.0 / (axial_[e] / rod.share[e] + axial_[e + 1] / rod.share[e + 1]);
    }
    rod.tip_distance = Eigen::VectorXd::LinSpaced(n_, length_, 0.0);
    return rod;
  }

  const std::vector<Tool>& tools_;
  const std::vector<ToolPlace>& places_;
  const int n_;  // nodes
  double length_ = 0.0, h_ = 0.0;
  Eigen::VectorXd compliance_, axial_;  // (n) integrals of w/K, w/EA
  Eigen::VectorXd mass_;                // (n) of w times mass
  Eigen::MatrixXd outside_;             // (tools, n) of w where a tool is the outermost
  Eigen::MatrixXd torsional_;           // (T, n) of w/GJ
  ToolTerms terms_;
};

}  // namespace

Composite build_composite(const std::vector<Tool>& tools, const std::vector<ToolPlace>& places,
                          int elements) {
  expects(!tools.empty() && tools.size() <= kMostTools && places.size() == tools.size());
  expects(elements >= 2);
  double longest = 0.0;
  for (std::size_t i = 0; i < tools.size(); ++i) {
    expects(tools[i].wire.round() && places[i].insertion >= 0.0);
    expects(places[i].insertion <= tools[i].wire.length() * (1.0 + 1e-12));
    longest = std::max(longest, places[i].insertion);
  }
  expects(longest > 0.0);
  return Builder(tools, places, elements).build();
}

}  // namespace wireplan::simulate
