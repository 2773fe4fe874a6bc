// MuJoCo: the robot as an MJCF document, stepped by mj_forward() and its integrators.
// Layer: hal/sim/engines.  Thread: one.
#include <fmt/format.h>
#include <mujoco/mujoco.h>

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <algorithm>
#include <cstring>

#include "hal/sim/engine.hpp"
#include "hal/sim/engines/masses.hpp"

namespace tandem::sim {
namespace {

using Eigen::Matrix3d;
using Eigen::Quaterniond;
using Eigen::Vector3d;

std::string text(const Vector3d& v) {
  return fmt::format("{:.17g} {:.17g} {:.17g}", v.x(), v.y(), v.z());
}

std::string text(const Matrix3d& R) {
  const Quaterniond q(R);
  return fmt::format("{:.17g} {:.17g} {:.17g} {:.17g}", q.w(), q.x(), q.y(), q.z());
}

// A body's own mass, in principal axes.
std::string inertial(const model::Inertia& inertia) {
  const Eigen::SelfAdjointEigenSolver<Matrix3d> principal(inertia.about_com_kg_m2);
  Matrix3d axes = principal.eigenvectors();
  if (axes.determinant() < 0.0) axes.col(0) *= -1.0;
  return fmt::format(R"(<inertial mass="{:.17g}" pos="{}" quat="{}" diaginertia="{}"/>)",
                     inertia.mass_kg, text(inertia.com_m), text(axes),
                     text(Vector3d(principal.eigenvalues()))) +
         "\n";
}

class Document {
 public:
  explicit Document(const EngineModel& model) : model_(model) {}

  std::string text_of_robot() const {
    const auto& [x, y, z] = model_.gravity_m_s2;
    return fmt::format(
               R"(<mujoco>
<compiler angle="radian" inertiafromgeom="false" balanceinertia="false"/>
<option timestep="{:.17g}" gravity="{}" integrator="Euler" cone="elliptic" solver="Newton"/>
<size njmax="{}" nconmax="{}"/>
<default><geom contype="0" conaffinity="0" condim="3" friction="{:.17g} 0 0" mass="0"/></default>
<worldbody>
)",
               model_.step_s, sim::text(Vector3d(x, y, z)), 8 * model_.points.size() + 64,
               model_.points.size() + 16, model_.friction) +
           fmt::format(R"(<geom name="ground" type="plane" size="0 0 1" pos="0 0 {:.17g}" )"
                       R"(conaffinity="1"/>)",
                       model_.ground_m - EngineModel::kRadius_m) +
           "\n" + body(0, {}) + "</worldbody>\n</mujoco>\n";
  }

 private:
  std::string body(int index, const model::Placement& at) const {
    const model::Tree& tree = model_.tree;
    std::string out = fmt::format(R"(<body name="b{}" pos="{}" quat="{}">)", index, sim::text(at.p),
                                  sim::text(at.R)) +
                      "\n";
    if (index == 0) {
      if (tree.floating_base) out += "<freejoint/>\n";
    } else {
      out += joint(index - 1);
    }
    const model::Inertia& inertia = tree.bodies[index].inertia;
    if (inertia.mass_kg > 0.0) out += inertial(inertia);
    for (std::size_t i = 0; i < model_.points.size(); ++i) {
      if (model_.points[i].body != index) continue;
      out += fmt::format(R"(<geom name="p{}" type="sphere" size="{:.17g}" pos="{}" contype="1"/>)",
                         i, EngineModel::kRadius_m, sim::text(model_.points[i].in_body_m)) +
             "\n";
    }
    for (std::size_t j = 0; j < tree.joints.size(); ++j) {
      if (tree.joints[j].parent == index)
        out += body(static_cast<int>(j) + 1, tree.joints[j].in_parent);
    }
    return out + "</body>\n";
  }

  std::string joint(int index) const {
    const model::Joint& joint = model_.tree.joints[index];
    return fmt::format(R"(<joint name="j{}" type="{}" axis="{}" armature="{:.17g}"/>)", index,
                       joint.type == model::JointType::kPrismatic ? "slide" : "hinge",
                       sim::text(joint.axis), model_.armature_kg_m2[index]) +
           "\n";
  }

  const EngineModel& model_;
};

struct FreeModel {
  void operator()(mjModel* model) const noexcept { mj_deleteModel(model); }
};
struct FreeData {
  void operator()(mjData* data) const noexcept { mj_deleteData(data); }
};

class Mujoco final : public Engine {
 public:
  static Result<std::unique_ptr<Engine>> create(const EngineModel& model) {
    mju_user_warning = [](const char*) {};  // else it writes a file where the program stands
    // MuJoCo's own refusal names bodies and lines of a document that nobody sees.
    if (const Status masses = check_masses(model.tree, "MuJoCo", true, mjMINVAL); !masses)
      return std::unexpected(masses.error());
    auto engine = std::make_unique<Mujoco>();
    const std::string document = Document(model).text_of_robot();
    const auto files = std::make_unique<mjVFS>();  // megabytes
    mj_defaultVFS(files.get());
    constexpr const char* kName = "robot.xml";
    mj_makeEmptyFileVFS(files.get(), kName, static_cast<int>(document.size()));
    const int file = mj_findFileVFS(files.get(), kName);
    std::memcpy(files->filedata[file], document.data(), document.size());
    char why[1000] = "";
    engine->model_.reset(mj_loadXML(kName, files.get(), why, sizeof why));
    mj_deleteVFS(files.get());
    if (!engine->model_) return fail(why, "set engine = \"tandem\", or another one");
    engine->data_.reset(mj_makeData(engine->model_.get()));
    if (!engine->data_) return fail("MuJoCo has no memory for it", "free some");
    engine->floating_ = model.tree.floating_base;
    engine->rk4_ = model.rk4;
    engine->number(model);
    return engine;
  }

  void set_state(const double* q, const double* v) override {
    mj_resetData(model_.get(), data_.get());
    place(q, v);
  }

  void step(double step_s, const double* tau, double* q, double* v, double* forces_W) override {
    model_->opt.timestep = step_s;
    load(tau);
    mj_forward(model_.get(), data_.get());
    read_forces(forces_W);
    if (rk4_) {
      mj_RungeKutta(model_.get(), data_.get(), 4);
    } else {
      mj_Euler(model_.get(), data_.get());
    }
    read_state(q, v);
  }

  void accelerations(const double* q, const double* v, const double* tau, double* vdot) override {
    model_->opt.disableflags |= mjDSBL_CONTACT;
    set_state(q, v);
    load(tau);
    mj_forward(model_.get(), data_.get());
    model_->opt.disableflags &= ~mjDSBL_CONTACT;
    const std::size_t base = floating_ ? 6 : 0;
    for (std::size_t i = 0; i < joints_.size(); ++i)
      vdot[base + i] = data_->qacc[joints_[i].velocity];
    if (!floating_) return;
    // The base's velocity turns with it: d(R^T v_W)/dt = R^T a_W - w x v.
    const Eigen::Map<const Vector3d> linear(v), angular(v + 3);
    const Vector3d a_W(data_->qacc[0], data_->qacc[1], data_->qacc[2]);
    Eigen::Map<Vector3d>{vdot} = base_turn().transpose() * a_W - angular.cross(linear);
    std::copy_n(data_->qacc + 3, 3, vdot + 3);
  }

  void archive(Archive& ar) override {
    ar.raw(data_->qpos, model_->nq * sizeof(mjtNum));
    ar.raw(data_->qvel, model_->nv * sizeof(mjtNum));
    ar.raw(data_->qacc_warmstart, model_->nv * sizeof(mjtNum));
  }

 private:
  struct JointAt {
    int position, velocity;  // in qpos and qvel
  };

  // MuJoCo numbers joints and shapes in its own order.
  void number(const EngineModel& model) {
    for (std::size_t j = 0; j < model.tree.joints.size(); ++j) {
      const int id = mj_name2id(model_.get(), mjOBJ_JOINT, fmt::format("j{}", j).c_str());
      joints_.push_back({model_->jnt_qposadr[id], model_->jnt_dofadr[id]});
    }
    point_of_.assign(model_->ngeom, -1);
    for (std::size_t i = 0; i < model.points.size(); ++i) {
      const int id = mj_name2id(model_.get(), mjOBJ_GEOM, fmt::format("p{}", i).c_str());
      point_of_[id] = static_cast<int>(i);
    }
    points_ = model.points.size();
  }

  // The base's rotation. Its free joint comes first in qpos: p, then w x y z.
  [[nodiscard]] Matrix3d base_turn() const {
    const mjtNum* q = data_->qpos + 3;
    return Quaterniond(q[0], q[1], q[2], q[3]).normalized().toRotationMatrix();
  }

  void place(const double* q, const double* v) {
    if (floating_) {
      std::copy_n(q, 3, data_->qpos);
      data_->qpos[3] = q[6];
      std::copy_n(q + 3, 3, data_->qpos + 4);
      Eigen::Map<Vector3d>{data_->qvel} = base_turn() * Eigen::Map<const Vector3d>(v);
      std::copy_n(v + 3, 3, data_->qvel + 3);
    }
    for (std::size_t i = 0; i < joints_.size(); ++i) {
      data_->qpos[joints_[i].position] = q[(floating_ ? 7 : 0) + i];
      data_->qvel[joints_[i].velocity] = v[(floating_ ? 6 : 0) + i];
    }
  }

  void read_state(double* q, double* v) const {
    if (floating_) {
      std::copy_n(data_->qpos, 3, q);
      std::copy_n(data_->qpos + 4, 3, q + 3);
      q[6] = data_->qpos[3];
      Eigen::Map<Vector3d>{v} = base_turn().transpose() * Eigen::Map<const Vector3d>(data_->qvel);
      std::copy_n(data_->qvel + 3, 3, v + 3);
    }
    for (std::size_t i = 0; i < joints_.size(); ++i) {
      q[(floating_ ? 7 : 0) + i] = data_->qpos[joints_[i].position];
      v[(floating_ ? 6 : 0) + i] = data_->qvel[joints_[i].velocity];
    }
  }

  void load(const double* tau) {
    if (floating_) {
      Eigen::Map<Vector3d>{data_->qfrc_applied} = base_turn() * Eigen::Map<const Vector3d>(tau);
      std::copy_n(tau + 3, 3, data_->qfrc_applied + 3);
    }
    for (std::size_t i = 0; i < joints_.size(); ++i)
      data_->qfrc_applied[joints_[i].velocity] = tau[(floating_ ? 6 : 0) + i];
  }

  void read_forces(double* forces_W) const {
    std::fill_n(forces_W, 3 * points_, 0.0);
    for (int c = 0; c < data_->ncon; ++c) {
      const mjContact& contact = data_->contact[c];
      const bool second = point_of_[contact.geom2] >= 0;
      const int point = point_of_[second ? contact.geom2 : contact.geom1];
      if (point < 0) continue;
      mjtNum in_frame[6];
      mj_contactForce(model_.get(), data_.get(), c, in_frame);
      // The frame's rows are the normal, from the first shape to the second, and two tangents.
      for (int axis = 0; axis < 3; ++axis)
        for (int row = 0; row < 3; ++row)
          forces_W[3 * point + axis] +=
              (second ? 1.0 : -1.0) * contact.frame[3 * row + axis] * in_frame[row];
    }
  }

  std::unique_ptr<mjModel, FreeModel> model_;
  std::unique_ptr<mjData, FreeData> data_;
  std::vector<JointAt> joints_;
  std::vector<int> point_of_;  // of a shape; -1: none
  std::size_t points_ = 0;
  bool floating_ = false, rk4_ = false;
};

}  // namespace
}  // namespace tandem::sim

TANDEM_ENGINE({.interface = tandem::sim::kEngineInterface,
               .compiler = __VERSION__,
               .name = "mujoco",
               .version = mj_versionString(),
               .integrator = "semi-implicit Euler, order 1",
               .settings = "cone = elliptic (default: pyramidal), balanceinertia = false",
               .armature = true,
               .rk4 = true,
               .create = tandem::sim::Mujoco::create})
