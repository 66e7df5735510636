/* Interface facts of ros2_control for tests: only what a generated transmission needs. */
#ifndef TEST_HANDLE_HPP
#define TEST_HANDLE_HPP
#include <string>

namespace transmission_interface {

class Handle {
public:
  Handle(const std::string & prefix, const std::string & interface, double * value)
  : prefix_(prefix), interface_(interface), value_(value) {}
  const std::string & get_prefix_name() const { return prefix_; }
  const std::string & get_interface_name() const { return interface_; }
  double get_value() const { return *value_; }
  bool set_value(double value) {
    *value_ = value;
    return true;
  }

private:
  std::string prefix_, interface_;
  double * value_;
};

class ActuatorHandle : public Handle {
public:
  using Handle::Handle;
};

class JointHandle : public Handle {
public:
  using Handle::Handle;
};

}  // namespace transmission_interface

#endif
