// Zip files for tests, whose files are not compressed.
#pragma once

#include <zlib.h>

#include <cstdint>
#include <map>
#include <string>

namespace webots_cloud {

/// A zip file of these: name -> content.
inline std::string stored_zip(std::map<std::string, std::string> const& files)
{
    auto const number = [](std::uint64_t value, int bytes) {
        std::string text;
        for (; bytes > 0; --bytes, value >>= 8)
            text += static_cast<char>(value & 0xff);
        return text;
    };
    std::string zip;
    std::string list;
    for (auto const& [name, content] : files) {
        auto const checksum =
            crc32(0, reinterpret_cast<Bytef const*>(content.data()), static_cast<uInt>(content.size()));
        auto const header = number(20, 2) + number(0, 8) + number(checksum, 4) + number(content.size(), 4) +
                            number(content.size(), 4) + number(name.size(), 2) + number(0, 2);
        list += "PK\1\2" + number(20, 2) + header + number(0, 10) + number(zip.size(), 4) + name;
        zip += "PK\3\4" + header + name + content;
    }
    auto const end = number(0, 4) + number(files.size(), 2) + number(files.size(), 2) +
                     number(list.size(), 4) + number(zip.size(), 4) + number(0, 2);
    return zip + list + "PK\5\6" + end;
}

} // namespace webots_cloud
