#ifndef TEST_HAL_H
#define TEST_HAL_H
int hal_init(const char *name);
int hal_ready(int component);
int hal_exit(int component);
#endif
