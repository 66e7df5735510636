/* Memory functions of a WebAssembly module: instructions of the engine, or those of memory.c. */
#ifndef SCREWSYNTH_STRINGH
#define SCREWSYNTH_STRINGH

#include <stddef.h>

#define memcpy __builtin_memcpy
#define memmove __builtin_memmove
#define memset __builtin_memset

#endif
