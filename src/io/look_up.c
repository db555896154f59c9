/* What a path is, by stat() of POSIX: Fortran knows neither the struct nor its macros. */
#define _POSIX_C_SOURCE 200809L
#include <stdint.h>
#include <sys/stat.h>

/* 0: nothing, 1: a regular file, 2: what is none; and by what device and number it is told from others.
   A link is what it leads to if it is followed. */
int razy_look_up(const char *path, int followed, int64_t identity[2])
{
    struct stat found;

    if ((followed ? stat(path, &found) : lstat(path, &found)) != 0)
        return 0;
    identity[0] = (int64_t)found.st_dev;
    identity[1] = (int64_t)found.st_ino;
    return S_ISREG(found.st_mode) ? 1 : 2;
}
