#ifndef TEST_RTAPI_APP_H
#define TEST_RTAPI_APP_H
int rtapi_app_main(void);
void rtapi_app_exit(void);
#endif
