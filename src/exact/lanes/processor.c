/* The widest vectors of this processor, as a level of x86-64: 4 (eight numbers), 3 (four) or 2 (two); 2 of every other kind. */
int razy_vector_level(void);

int razy_vector_level(void) {
#if defined(__GNUC__) && defined(__x86_64__)
  __builtin_cpu_init();
  if (!__builtin_cpu_supports("avx2") || !__builtin_cpu_supports("fma") || !__builtin_cpu_supports("bmi2")) return 2;
  if (!__builtin_cpu_supports("avx512f") || !__builtin_cpu_supports("avx512vl") || !__builtin_cpu_supports("avx512bw") ||
      !__builtin_cpu_supports("avx512dq") || !__builtin_cpu_supports("avx512cd"))
    return 3;
  return 4;
#else
  return 2;
#endif
}
