// What a session server and a machine say to each other about simulations that are to be ready for classes
// (protocol section 13.20).
#pragma once

#include <boost/json/fwd.hpp>

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace webots_cloud::core {

inline constexpr std::size_t max_staging_wishes = 20; ///< As many as there can be classes.
inline constexpr int max_staging_count = 10'000;      ///< Of one world.

/// So many simulations of a world are to be ready.
struct StagingWish
{
    StagingWish() = default;

    std::string url;
    std::string mode;
    int count = 0;

    bool operator==(StagingWish const&) const = default;
};

/// `{"stage":[{"url":"...","mode":"mjpeg","count":15}]}`: replaces what was said before.
struct StageMessage
{
    StageMessage() = default;

    std::vector<StagingWish> wishes;

    bool operator==(StageMessage const&) const = default;
};

std::string stage_message(std::vector<StagingWish> const& wishes);

/// Of the value of `stage`; nothing: it is malformed.
std::optional<StageMessage> read_stage_message(boost::json::value const& value);

/// What has become of a wish.
struct StagedFigure
{
    StagedFigure() = default;

    std::string url;
    std::string mode;
    int ready = 0; ///< Simulations.
    int taken = 0; ///< By browsers since the first wish for the world on this connection.

    bool operator==(StagedFigure const&) const = default;
};

/// `{"staged":[{"url":"...","mode":"mjpeg","ready":12,"taken":3}]}`
std::string staged_message(std::vector<StagedFigure> const& figures);

/// Nothing: it is another message, or malformed.
std::optional<std::vector<StagedFigure>> parse_staged_message(std::string_view text);

} // namespace webots_cloud::core
