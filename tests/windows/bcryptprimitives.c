/* Windows 10 has bcryptprimitives.dll, from which Rust's standard library takes random numbers; Wine 8 has not.
   Built beside the program that is tested under Wine, and for nothing else:
   x86_64-w64-mingw32-gcc -shared bcryptprimitives.c -o bcryptprimitives.dll -ladvapi32 */
#include <windows.h>

/* RtlGenRandom, by the name under which advapi32.dll has it. */
BOOLEAN NTAPI SystemFunction036(PVOID bytes, ULONG length);

__declspec(dllexport) BOOL WINAPI ProcessPrng(PBYTE bytes, SIZE_T length)
{
    return SystemFunction036(bytes, (ULONG)length);
}
