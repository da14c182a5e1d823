// Lists of worlds: what a machine answers at `/worlds`, and what the gallery of a site shows.
#pragma once

#include <webots_cloud/error.hpp>
#include <webots_cloud/listed_world.hpp>

#include <boost/json/object.hpp>

#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace webots_cloud::core {

/// Of a machine, and of the gallery.
inline constexpr std::size_t max_listed_worlds = 200;
/// Bytes of the answer of a machine: all worlds with their texts.
inline constexpr std::size_t max_world_list = std::size_t{640} << 10;

/// Whether an address is that of a world, not of a folder of worlds.
bool is_world_link(std::string_view url) noexcept;

/// What a world is called of which nothing is known but its address: `pick_and_place.wbt` is "Pick and
/// place".
std::string title_of_address(std::string_view url);

/// What a picture of a world is known by: the same for equal addresses, however they are spelled. 16
/// hexadecimal digits.
std::string picture_key(std::string_view url);

/// `{"worlds":[{"url":...,"title":...,"text":...,"titles":{"de":...},"texts":{"de":...}}],
/// "pictures":["<key>"]}`; what is empty is left out, but for the worlds, and so is what is too much of texts
/// in languages.   `pictures`: the keys of those that a machine has.
std::string world_list_json(std::span<ListedWorld const> worlds, std::span<std::string const> pictures = {});

/// `{"error":"<sentence>","code":"<code>","values":{...}}`: why there is no list, as `reason:` says it on
/// /client.
std::string world_list_error(Failure const& why);

/// The same as a machine answers it: an answer for pages, of texts alone. Nothing: it is none.
std::optional<std::string> parse_world_list_error(std::string_view json);

/// The same for the pages of the gallery and of the viewer: worlds of which there is a picture have
/// `"picture":"picture/<key>"`, and `site`, unless it is empty, is what these pages take from the
/// configuration.
std::string gallery_json(std::span<ListedWorld const> worlds, std::span<std::string const> pictures,
                         boost::json::object site = {});

/// The same as a machine answers it, which is not trusted: what can't be a world is left out. Nothing: it is
/// no such list.
std::optional<std::vector<ListedWorld>> parse_world_list(std::string_view json);

/// The keys of pictures in such an answer.
std::vector<std::string> parse_picture_keys(std::string_view json);

/// What the gallery shows, each world once.   `configured`: of the operator, where a folder stands for the
/// worlds in it; nothing: all that machines have found, after `viewer_url`. `found`: by machines.
std::vector<ListedWorld> gallery_worlds(std::optional<std::vector<ListedWorld>> const& configured,
                                        std::string_view viewer_url, std::span<ListedWorld const> found);

} // namespace webots_cloud::core
