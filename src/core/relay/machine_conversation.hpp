// What a machine's messages mean to a session server that relays them: whether they go on to the browser,
// and whether another machine is to be tried.
#pragma once

#include "relay_messages.hpp"

#include <webots_cloud/time.hpp>

#include <string>
#include <string_view>
#include <vector>

namespace webots_cloud::core {

/// Why a machine does not run a simulation.
enum class MachineRefusal
{
    none,
    full,    ///< It has no place now.
    machine, ///< Another machine may take it.
    needs,   ///< Only a machine with certain labels can run it.
    silent   ///< It can't be reached, says nothing for too long, or has closed without a word.
};

/// One start, or one return, on one machine.
class MachineConversation
{
public:
    /// `is_ours`: the machine's reports are those of a server of this project, which say more and speak soon.
    MachineConversation(RelayOptions options, std::string entry, bool is_ours);

    struct Step
    {
        Step() = default;

        std::string for_browser; ///< Empty: nothing.
        MachineRefusal refusal = MachineRefusal::none;
    };

    Step take(std::string message);

    /// The machine has closed the connection, or is lost: whether another one is to be tried.
    MachineRefusal on_end() const noexcept;

    /// How long the machine may say nothing from now on; `Duration::max()`: for ever.
    Duration patience() const noexcept;

    /// The simulation runs: the connection is its lease.
    bool is_ready() const noexcept { return is_ready_; }

    /// With `MachineRefusal::needs`.
    std::vector<std::string> const& needs() const noexcept { return needs_; }

    /// The machine's sentence, once it has refused; empty: it said none.
    std::string const& last_word() const noexcept { return last_word_; }

    /// The message for browsers that goes before that sentence; empty: none.
    std::string const& last_reason() const noexcept { return last_reason_; }

private:
    Step take_refusal(std::string_view why);
    Step take_error(std::string_view message);
    std::string with_entry(std::string_view message) const;
    bool is_for_browser(std::string_view message) const noexcept;

    RelayOptions options_;
    std::string entry_;
    bool is_ours_;
    bool is_ready_ = false;
    bool promises_heartbeat_ = false;
    bool has_said_error_ = false;
    MachineRefusal announced_ = MachineRefusal::none;
    std::vector<std::string> needs_;
    std::string last_word_;
    std::string last_reason_;
};

} // namespace webots_cloud::core
