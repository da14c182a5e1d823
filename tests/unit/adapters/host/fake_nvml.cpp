// A fake of NVIDIA's library with two graphics processors, one of which does not report its load.
#include <cstdio>

extern "C" {
struct Utilization
{
    unsigned gpu;
    unsigned memory;
};
struct Memory
{
    unsigned long long total;
    unsigned long long free;
    unsigned long long used;
};

struct ProcessUtilization
{
    unsigned process;
    unsigned long long time;
    unsigned compute;
    unsigned memory;
    unsigned encoder;
    unsigned decoder;
};

static int devices[2];

int nvmlInit_v2()
{
    return 0;
}

int nvmlDeviceGetCount_v2(unsigned* count)
{
    *count = 2;
    return 0;
}

int nvmlDeviceGetHandleByIndex_v2(unsigned index, void** device)
{
    *device = &devices[index];
    return 0;
}

int nvmlDeviceGetName(void*, char* name, unsigned length)
{
    std::snprintf(name, length, "NVIDIA Fake");
    return 0;
}

int nvmlDeviceGetUtilizationRates(void* device, Utilization* utilization)
{
    constexpr int not_supported = 3;
    if (device == &devices[1])
        return not_supported;
    *utilization = {35, 20};
    return 0;
}

/// Process 17 keeps a quarter of the first one busy, in each call; the second one does not say.
int nvmlDeviceGetProcessUtilization(void* device, ProcessUtilization* samples, unsigned* count,
                                    unsigned long long since)
{
    constexpr int not_supported = 3;
    if (device == &devices[1] || *count < 3)
        return not_supported;
    samples[0] = {17, since + 1, 20, 0, 0, 0};
    samples[1] = {17, since + 2, 30, 0, 0, 0};
    samples[2] = {18, since + 2, 0, 0, 0, 0};
    *count = 3;
    return 0;
}

int nvmlDeviceGetMemoryInfo(void* device, Memory* memory)
{
    constexpr auto gigabyte = 1ULL << 30;
    *memory = {16 * gigabyte, 0, device == &devices[0] ? gigabyte : 12 * gigabyte};
    return 0;
}
}
