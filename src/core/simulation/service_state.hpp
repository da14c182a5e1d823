// Whether a simulation server takes new simulations, and when it ends.
#pragma once

#include <cstddef>

namespace webots_cloud::core {

/// Owned by the service; sessions and pages look at it.
class ServiceState
{
public:
    /// Takes no new simulations from now on. With `exit_when_empty` the server ends after the last one.
    void drain(bool exit_when_empty) { intake_ = exit_when_empty ? Intake::until_empty : Intake::draining; }

    /// Takes new simulations again.
    void serve() { intake_ = Intake::open; }

    /// The server ends: no browser that lost its connection is waited for.
    void stop() { stopping_ = true; }

    bool is_draining() const noexcept { return intake_ != Intake::open; }
    bool is_stopping() const noexcept { return stopping_; }

    /// It was asked to end with its last simulation, and that has ended.
    bool has_finished(std::size_t simulations) const noexcept
    {
        return intake_ == Intake::until_empty && simulations == 0;
    }

private:
    enum class Intake
    {
        open,
        draining,   ///< Until it is asked to serve again.
        until_empty ///< And then the server ends.
    };

    Intake intake_ = Intake::open;
    bool stopping_ = false; ///< Of a drained server as well as of another one.
};

} // namespace webots_cloud::core
