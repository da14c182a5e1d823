// The places of a simulation server: how many there are, and who has them.
#pragma once

#include "client_limit.hpp"
#include "silent_clients.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>

namespace webots_cloud::core {

struct AdmissionLimits
{
    AdmissionLimits() = default;

    int max_simulations = 0;
    std::size_t max_silent = 0; ///< Browsers that have not said what they want.
    std::size_t silent_per_address = 0;
};

/// Counts the browsers that have not said yet what they want, and the simulations that are started, run or
/// are ended: all of them, those of each client and those of each world. Nobody else counts them.
/// Lifetime: must outlive its places.
class Admission
{
public:
    explicit Admission(AdmissionLimits limits)
        : max_simulations_(limits.max_simulations),
          clients_(0, static_cast<std::size_t>(std::max(0, limits.max_simulations))),
          silent_(limits.max_silent, limits.silent_per_address)
    {}
    Admission(Admission const&) = delete;
    Admission& operator=(Admission const&) = delete;

    /// The right to one simulation, given back when it is destroyed.
    class Place
    {
    public:
        Place() = default; ///< None.
        Place(Place const&) = delete;
        Place& operator=(Place const&) = delete;
        ~Place() { release(); }

        /// Gives the right back now.
        void release()
        {
            client_.release();
            world_.release();
            if (auto* const admission = std::exchange(admission_, nullptr))
                --admission->simulations_;
        }

    private:
        friend Admission;
        Admission* admission_ = nullptr;
        ClientLimit::Ticket client_;
        ClientLimit::Ticket world_;
    };

    enum class Verdict
    {
        admitted,
        full,              ///< The machine has no place.
        world_full,        ///< The world may have no more.
        client_full_first, ///< The client may have no more; worth a line in the log, as in `ClientLimit`.
        client_full
    };

    /// `place`, which must be none, is the client's when it is admitted. An empty key is nobody's, an empty
    /// world none: they are not counted.
    Verdict admit(std::string const& quota_key, std::string const& world, Place& place)
    {
        if (worlds_.admit(world, place.world_) != ClientLimit::Verdict::admitted)
            return Verdict::world_full;
        auto const verdict = admit_client(quota_key, place);
        if (verdict != Verdict::admitted)
            place.release();
        return verdict;
    }

    /// A browser has come: `SilentClients::enter`.
    std::optional<std::uint64_t> add_silent(std::uint64_t id, std::string const& quota_key)
    {
        return silent_.enter(id, quota_key);
    }

    /// It has said what it wants, or has left.
    void remove_silent(std::uint64_t id) { silent_.leave(id); }

    /// Whose limit the last `client_full_first` or `client_full` was due to.
    QuotaCounts::Full const& full_client() const noexcept { return clients_.refused(); }

    bool is_full() const noexcept { return simulations_ >= max_simulations_; }
    int simulations() const noexcept { return simulations_; }
    int max_simulations() const noexcept { return max_simulations_; }
    std::size_t simulations_per_address() const noexcept { return clients_.max(); }

    /// 0, as at first: no limit. A client that has more keeps it.
    void set_simulations_per_address(std::size_t max) noexcept { clients_.set_max(max); }

    std::size_t simulations_per_world() const noexcept { return worlds_.max(); }
    /// 0, as at first: no limit.
    void set_simulations_per_world(std::size_t max) noexcept { worlds_.set_max(max); }

private:
    Verdict admit_client(std::string const& quota_key, Place& place)
    {
        if (is_full())
            return Verdict::full;
        switch (clients_.admit(quota_key, place.client_)) {
        case ClientLimit::Verdict::refused_first:
            return Verdict::client_full_first;
        case ClientLimit::Verdict::refused:
            return Verdict::client_full;
        case ClientLimit::Verdict::admitted:
            break;
        }
        place.admission_ = this;
        ++simulations_;
        return Verdict::admitted;
    }

    int max_simulations_;
    int simulations_ = 0;
    ClientLimit clients_;
    ClientLimit worlds_;
    SilentClients silent_;
};

} // namespace webots_cloud::core
