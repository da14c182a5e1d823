#include "jpeg.hpp"

#include <csetjmp>
#include <cstdio>
#include <cstdlib>
#include <stdexcept>

#include <jpeglib.h>

namespace webots_cloud::demo {
namespace {

/// libjpeg reports errors by not returning; its default would end the process.
struct Failure
{
    jpeg_error_mgr manager;
    std::jmp_buf jump;
    char text[JMSG_LENGTH_MAX];
};

void fail(j_common_ptr info)
{
    auto* const failure = reinterpret_cast<Failure*>(info->err);
    info->err->format_message(info, failure->text);
    std::longjmp(failure->jump, 1);
}

void compress(jpeg_compress_struct& info, Pixels const& pixels, int quality)
{
    info.image_width = static_cast<JDIMENSION>(pixels.width);
    info.image_height = static_cast<JDIMENSION>(pixels.height);
    info.input_components = 4;
    info.in_color_space = JCS_EXT_BGRX;
    jpeg_set_defaults(&info);
    jpeg_set_quality(&info, quality, TRUE);
    info.dct_method = JDCT_IFAST;
    jpeg_start_compress(&info, TRUE);
    while (info.next_scanline < info.image_height) {
        auto row = const_cast<JSAMPROW>(pixels.data + std::size_t{info.next_scanline} *
                                                          static_cast<std::size_t>(pixels.stride));
        jpeg_write_scanlines(&info, &row, 1);
    }
    jpeg_finish_compress(&info);
}

/// Only trivial objects live in this frame, so that longjmp() into it skips no destructor.
bool encode(Pixels const& pixels, int quality, Failure& failure, unsigned char** bytes, unsigned long* size)
{
    jpeg_compress_struct info{};
    info.err = jpeg_std_error(&failure.manager);
    failure.manager.error_exit = fail;
    if (setjmp(failure.jump)) { // NOLINT: the library's way
        jpeg_destroy_compress(&info);
        return false;
    }
    jpeg_create_compress(&info);
    jpeg_mem_dest(&info, bytes, size);
    compress(info, pixels, quality);
    jpeg_destroy_compress(&info);
    return true;
}

} // namespace

std::string jpeg_from(Pixels const& pixels, int quality)
{
    Failure failure{};
    unsigned char* bytes = nullptr;
    unsigned long size = 0;
    bool const encoded = encode(pixels, quality, failure, &bytes, &size);
    std::string jpeg;
    if (encoded)
        jpeg.assign(reinterpret_cast<char const*>(bytes), size);
    std::free(bytes);
    if (!encoded)
        throw std::runtime_error(std::string("cannot encode a picture: ") + failure.text);
    return jpeg;
}

} // namespace webots_cloud::demo
