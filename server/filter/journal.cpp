#include "server/filter/journal.hpp"

namespace saccade {

using Eigen::VectorXd;

namespace {

constexpr int kPoseDim = 6;

VectorXd Extended(const VectorXd& step, int size) {
  VectorXd longer = VectorXd::Zero(step.size() + size);
  longer.head(step.size()) = step;
  return longer;
}

VectorXd Apply(const Journal::Updated& update, VectorXd step) {
  VectorXd seen(2 * static_cast<Eigen::Index>(update.rows.size()));
  for (std::size_t k = 0; k < update.rows.size(); ++k) {
    const Journal::Updated::Rows& rows = update.rows[k];
    Eigen::Vector2d sum = rows.d_camera * step.segment<kPoseDim>(rows.camera);
    if (rows.readout >= 0) sum += rows.d_readout * step[rows.readout];
    if (rows.clone >= 0) {
      sum += rows.d_clone * step.segment<kPoseDim>(rows.clone) +
             rows.d_point * step.segment(rows.point, rows.d_point.cols());
    }
    seen.segment<2>(2 * static_cast<Eigen::Index>(k)) = sum;
  }
  if (update.factor.size() > 0) {
    update.factor.triangularView<Eigen::Lower>().solveInPlace(seen);
  }
  step.noalias() -= update.gain * seen;
  return step;
}

VectorXd Apply(const Journal::Predicted& prediction, VectorXd step) {
  auto part = step.segment(prediction.offset, prediction.f.rows());
  part = (prediction.f * part).eval();
  return step;
}

VectorXd Apply(const Journal::Cloned& cloned, VectorXd step) {
  VectorXd longer = Extended(step, kPoseDim);
  longer.tail<kPoseDim>() = step.segment<kPoseDim>(cloned.offset);
  return longer;
}

VectorXd Apply(const Journal::Appended& appended, VectorXd step) {
  return Extended(step, appended.size);
}

VectorXd Apply(const Journal::Told& told, VectorXd step) {
  step[told.offset] = 0.0;
  return step;
}

VectorXd Apply(const Journal::Kept& kept, VectorXd step) {
  VectorXd shorter(static_cast<Eigen::Index>(kept.rows.size()));
  for (std::size_t k = 0; k < kept.rows.size(); ++k) {
    shorter[static_cast<Eigen::Index>(k)] = step[kept.rows[k]];
  }
  return shorter;
}

}  // namespace

VectorXd Journal::Carry(VectorXd step) const {
  for (const Entry& entry : entries_) {
    step = std::visit([&](const auto& each) { return Apply(each, std::move(step)); }, entry);
  }
  return step;
}

}  // namespace saccade
