/* Mathematical functions of extended precision under the names that flang gives them, from glibc. flang's own run-time library has
   them only if it was built with a library of quadruple precision, and its functions of 80-bit numbers are these too. */
#define _GNU_SOURCE
#include <complex.h>
#include <math.h>

#define FUNCTION(name, function, kind) kind _FortranA##name##F128(kind x) { return function(x); }

FUNCTION(Acos, acosf128, _Float128)
FUNCTION(Acosh, acoshf128, _Float128)
FUNCTION(Asin, asinf128, _Float128)
FUNCTION(Cos, cosf128, _Float128)
FUNCTION(Exp, expf128, _Float128)
FUNCTION(Log, logf128, _Float128)
FUNCTION(Sin, sinf128, _Float128)
FUNCTION(Sqrt, sqrtf128, _Float128)
FUNCTION(Tan, tanf128, _Float128)
FUNCTION(CExp, cexpf128, _Complex _Float128)
FUNCTION(CSqrt, csqrtf128, _Complex _Float128)

_Float128 _FortranAAtan2F128(_Float128 y, _Float128 x) { return atan2f128(y, x); }
_Float128 _FortranACAbsF128(_Complex _Float128 z) { return cabsf128(z); }
