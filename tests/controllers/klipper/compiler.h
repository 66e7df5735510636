/* Interface facts of Klipper for tests: only what a generated step generator needs. */
#ifndef TEST_COMPILER_H
#define TEST_COMPILER_H
#define __visible __attribute__((externally_visible))
#endif
