/* Interface facts of Arduino for tests: a serial port that prints to the terminal. */
#ifndef TEST_ARDUINO_H
#define TEST_ARDUINO_H
#include <cstdio>

struct TestSerial {
    void begin(unsigned long) {}
    void print(double value, int digits) { std::printf("%.*f", digits, value); }
    void print(char value) { std::putchar(value); }
    void println(const char *text) { std::puts(text); }
};
extern TestSerial Serial;
inline void delay(unsigned long) {}
void setup();
void loop();
#endif
