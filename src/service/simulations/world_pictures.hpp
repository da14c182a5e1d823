// The first good picture of each world that ran on this machine: `GET /worlds/picture/<key>`.
#pragma once

#include "core/pages/shared_page.hpp"
#include "simulation_session.hpp"
#include "status_endpoints.hpp"

#include <webots_cloud/transport/picture_taker.hpp>

#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <vector>

namespace webots_cloud {

/// Asks simulators that have run for some seconds, one at a time, each a few times at most. Few pictures are
/// kept, in memory: the oldest one goes. Projects of websites (`init`), which belong to one person each, are
/// left out.
///
/// Lifetime: all that it is made with must outlive it; `taker` may be null.   Thread-safety: one executor.
class WorldPictures
{
public:
    WorldPictures(PictureTaker* taker, SimulationSessions const& sessions, Clock& clock)
        : taker_(taker), sessions_(sessions), clock_(clock)
    {}

    /// Cancellation: terminal.
    boost::asio::awaitable<result<>> run();

    /// `key`: of the world's address (`core::picture_key`).
    HttpResponse answer(std::string_view key, std::string_view if_none_match) const;

    std::vector<std::string> keys() const;

private:
    struct Kept
    {
        std::uint64_t number = 0; ///< Later ones have higher numbers.
        core::SharedPage page;
    };

    std::shared_ptr<SimulationSession> next();
    void keep(std::string key, std::string picture);

    PictureTaker* taker_;
    SimulationSessions const& sessions_;
    Clock& clock_;
    std::map<std::string, Kept, std::less<>> kept_;
    std::map<std::uint64_t, int> looks_; ///< How often a simulation was found running without a picture.
    std::uint64_t last_number_ = 0;
};

} // namespace webots_cloud
