#include <stdio.h>

void put(char letter) { putchar(letter); }
