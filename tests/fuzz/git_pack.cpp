// Packs: whatever they claim, they stay within their budget. Digests are made right, which no mutation would
// hit.
#include "fuzz.hpp"

#include "adapters/files/project_files.hpp"
#include "adapters/files/remove_tree.hpp"
#include "adapters/git_packs/git_pack_reader.hpp"

#include <zlib.h>

#include <fcntl.h>

#include <filesystem>
#include <string>

using namespace webots_cloud;
using namespace webots_cloud::adapters;
namespace fs = std::filesystem;

namespace {

constexpr std::uint64_t budget = 100'000;

/// A folder for the files of a pack.
struct Scratch
{
    Scratch()
    {
        auto name = (fs::temp_directory_path() / "webots_cloud_pack_XXXXXX").string();
        fuzz::require(::mkdtemp(name.data()) != nullptr);
        path = name;
    }
    ~Scratch() { (void)remove_tree(path); }

    void clear() const
    {
        for (auto const& entry : fs::directory_iterator(path))
            fs::remove(entry.path());
    }

    fs::path path;
};

std::string deflated(std::string_view bytes)
{
    std::string out(compressBound(bytes.size()), '\0');
    uLongf size = out.size();
    compress2(reinterpret_cast<Bytef*>(out.data()), &size, reinterpret_cast<Bytef const*>(bytes.data()),
              bytes.size(), 1);
    out.resize(size);
    return out;
}

/// `<type> <length> <content>`; after the content of a delta the bytes that name its base.
std::string cook(std::string_view recipe)
{
    std::string objects;
    unsigned count = 0;
    for (; !recipe.empty() && count < 50; ++count) {
        auto const type = fuzz::take_byte(recipe) & 7;
        auto const content = fuzz::take(recipe, fuzz::take_byte(recipe));
        auto const base = type == 6   ? fuzz::take(recipe, 1)
                          : type == 7 ? fuzz::take(recipe, 20)
                                      : std::string_view();
        objects += static_cast<char>(0x80 | type << 4 | (content.size() & 15));
        objects += static_cast<char>(content.size() >> 4);
        objects.append(base).append(deflated(content));
    }
    return std::string("PACK\0\0\0\2\0\0\0", 11) + static_cast<char>(count) + objects;
}

result<> read(GitPackReader& reader, std::string_view pack, std::size_t piece)
{
    while (!pack.empty())
        if (auto const pushed = reader.push(fuzz::take(pack, piece)); !pushed)
            return pushed;
    return reader.finish();
}

} // namespace

int LLVMFuzzerTestOneInput(std::uint8_t const* data, std::size_t size)
{
    auto text = fuzz::text_of(data, size);
    auto const choice = fuzz::take_byte(text);
    auto pack = choice == 0 ? std::string(text) : cook(text);
    GitDigest digest;
    digest.update(pack);
    auto const id = digest.finish();
    pack.append(id.bytes.begin(), id.bytes.end());

    static Scratch const scratch;
    auto const folder = open_folder(AT_FDCWD, scratch.path.c_str());
    GitStaging staging(folder->get());
    GitPackReader reader(staging, budget);
    if (read(reader, pack, 1 + choice * 16))
        fuzz::require(reader.unpacked() <= budget && reader.objects_read() == reader.objects_total());
    scratch.clear();
    return 0;
}
