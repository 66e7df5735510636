#ifndef TEST_HARDWARE_INFO_HPP
#define TEST_HARDWARE_INFO_HPP
#include <string>
#include <vector>

namespace hardware_interface {

struct JointInfo {
  std::string name, role;
};

struct ActuatorInfo {
  std::string name, role;
};

struct TransmissionInfo {
  std::string name, type;
  std::vector<JointInfo> joints;
  std::vector<ActuatorInfo> actuators;
};

}  // namespace hardware_interface

#endif
