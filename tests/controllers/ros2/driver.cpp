/* Test of a generated transmission: the words in capitals are replaced, see test_kinematics_targets.py. */
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <limits>
#include "PACKAGE/transmission.hpp"

using namespace transmission_interface;
namespace own = PACKAGE;

static double uniform() { return 2.0 * std::rand() / RAND_MAX - 1.0; }

int main() {
  const int n = COUNT;
  /* Alphabetical order of the names is the reverse of the order of the roles. */
  hardware_interface::TransmissionInfo info;
  info.name = "test";
  for (int i = n - 1; i >= 0; --i) {
    info.joints.push_back({std::string("j") + char('z' - i), JOINTS[i]});
    info.actuators.push_back({std::string("m") + char('z' - i), ACTUATORS[i]});
  }
  own::CLASSLoader loader;
  std::shared_ptr<Transmission> found = loader.load(info);
  if (!found || found->num_joints() != COUNT) return 1;
  own::CLASS & own_class = dynamic_cast<own::CLASS &>(*found);
  double j[3][COUNT] = {}, m[3][COUNT] = {};
  const char * const names[] = {"velocity", "effort", "position"};
  const int index[] = {1, 2, 0};
  std::vector<JointHandle> joints;
  std::vector<ActuatorHandle> actuators;
  for (int i = n - 1; i >= 0; --i)
    for (int k = 0; k < 3; ++k) {
      joints.emplace_back(std::string("j") + char('z' - i), names[k], &j[index[k]][i]);
      actuators.emplace_back(std::string("m") + char('z' - i), names[(k + 1) % 3], &m[index[(k + 1) % 3]][i]);
    }
  joints.emplace_back("another", "position", &j[0][0]);
  found->configure(joints, actuators);
  const double home[] = {HOME}, spread[] = {SPREAD};
  double power = 0.0, back = 0.0;
  for (int state = 0; state < 1000; ++state) {
    double given[3][COUNT];
    for (int i = 0; i < n; ++i) {
      given[0][i] = j[0][i] = home[i] + spread[i] * uniform();
      given[1][i] = j[1][i] = spread[i] * uniform();
      given[2][i] = j[2][i] = uniform() / spread[i];
    }
    found->joint_to_actuator();
    if (own_class.fault()) return 2;
    double by_joints = 0.0, by_motors = 0.0, size = 0.0;
    for (int i = 0; i < n; ++i) {
      by_joints += j[1][i] * j[2][i];
      by_motors += m[1][i] * m[2][i];
      size += std::fabs(j[1][i] * j[2][i]) + std::fabs(m[1][i] * m[2][i]);
      if (state == 0) std::printf("%.17g %.17g\n", j[0][i], m[0][i]);
    }
    power = std::fmax(power, std::fabs(by_joints - by_motors) / size);
    for (int i = 0; i < n; ++i) j[0][i] = j[1][i] = j[2][i] = -77.0;
    found->actuator_to_joint();
    if (own_class.fault()) return 3;
    for (int i = 0; i < n; ++i) {
      back = std::fmax(back, std::fabs(j[0][i] - given[0][i]) / spread[i]);
      back = std::fmax(back, std::fabs(j[1][i] - given[1][i]) / spread[i]);
      back = std::fmax(back, std::fabs(j[2][i] - given[2][i]) * spread[i]);
    }
  }
  std::printf("%.3g %.3g\n", power, back);
  const double last = m[0][0], bad[] = {std::numeric_limits<double>::quiet_NaN(), FARTHEST};
  for (int k = 0; k < 2; ++k) {
    const double good = j[0][0], before = m[0][0];
    j[0][0] = bad[k];
    found->joint_to_actuator();
    if (!own_class.fault() || m[0][0] != before) return 4;
    j[0][0] = good;
    found->joint_to_actuator();
    if (own_class.fault() || std::fabs(m[0][0] - last) > 1e-9) return 5;
    const double kept = j[0][0], motor = m[0][0];
    m[0][0] = bad[0];
    found->actuator_to_joint();
    if (!own_class.fault() || j[0][0] != kept) return 6;
    m[0][0] = motor;
  }
  if (own_class.faults() != 4) return 7;
  info.joints.pop_back();
  return loader.load(info) ? 8 : 0;
}
