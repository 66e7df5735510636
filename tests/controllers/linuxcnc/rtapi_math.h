/* The functions that a real-time kernel offers, and no others. */
#ifndef TEST_RTAPI_MATH_H
#define TEST_RTAPI_MATH_H
double sin(double);
double cos(double);
double tan(double);
double sqrt(double);
double fabs(double);
double atan(double);
double atan2(double, double);
double asin(double);
double acos(double);
double exp(double);
double pow(double, double);
double fmin(double, double);
double fmax(double, double);
double fmod(double, double);
double round(double);
double ceil(double);
double floor(double);
#endif
