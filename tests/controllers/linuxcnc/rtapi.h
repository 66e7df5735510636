/* Interface facts of LinuxCNC for tests: only what a generated kinematics module needs. */
#ifndef TEST_RTAPI_H
#define TEST_RTAPI_H
#define EXPORT_SYMBOL(name) typedef int exported_##name
#define MODULE_LICENSE(text) typedef int licensed
#endif
