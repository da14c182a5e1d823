#include "machine_conversation.hpp"

#include "core/refusals.hpp"
#include "core/simulation/client_protocol.hpp"
#include "core/text.hpp"

namespace webots_cloud::core {
namespace {

constexpr std::string_view refusal_prefix = "refusal: ";
constexpr std::string_view needs_prefix = "needs ";
constexpr std::string_view heartbeat_prefix = "heartbeat: ";
constexpr std::string_view ready_prefix = "webots:";
constexpr std::string_view token_prefix = "reconnectToken: ";

constexpr std::size_t max_labels = 32;

/// One of our servers says something as soon as it is asked, and once a second from then on.
constexpr Duration patience_with_ours = std::chrono::seconds(10);
/// A Python server says nothing while it clones.
constexpr Duration patience_with_others = std::chrono::minutes(5);

} // namespace

MachineConversation::MachineConversation(RelayOptions options, std::string entry, bool is_ours)
    : options_(std::move(options)), entry_(std::move(entry)), is_ours_(is_ours)
{}

MachineConversation::Step MachineConversation::take(std::string message)
{
    if (!is_ready_ && message.starts_with(refusal_prefix))
        return take_refusal(std::string_view(message).substr(refusal_prefix.size()));
    if (!is_ready_ && message.starts_with(error_prefix))
        return take_error(message);
    if (announced_ != MachineRefusal::none && !is_ready_ && message.starts_with(reason_prefix)) {
        last_reason_ = std::move(message); // for later: another machine may take it
        return {};
    }
    promises_heartbeat_ |= message.starts_with(heartbeat_prefix);
    is_ready_ |= message.starts_with(ready_prefix);
    Step step;
    if (is_for_browser(message))
        step.for_browser = message.starts_with(token_prefix) ? with_entry(message) : std::move(message);
    return step;
}

/// A token as browsers get it.
std::string MachineConversation::with_entry(std::string_view message) const
{
    return concat(token_prefix, relayed_token(message.substr(token_prefix.size()), entry_));
}

/// Heartbeats are for us, unless the browser asked for them; those of simulators, which nobody can tell from
/// them, browsers have always got.
bool MachineConversation::is_for_browser(std::string_view message) const noexcept
{
    if (message.starts_with(heartbeat_prefix))
        return options_.wants_heartbeat;
    if (message.starts_with(token_prefix))
        return options_.can_return;
    if (message.starts_with(reason_prefix))
        return options_.wants_reasons;
    return message != heartbeat_message || options_.wants_heartbeat || is_ready_;
}

MachineConversation::Step MachineConversation::take_refusal(std::string_view why)
{
    announced_ = MachineRefusal::machine;
    if (why == "full")
        announced_ = MachineRefusal::full;
    if (why.starts_with(needs_prefix)) {
        announced_ = MachineRefusal::needs;
        needs_.clear();
        for (auto const label : split(why.substr(needs_prefix.size()), ' '))
            if (!label.empty() && needs_.size() < max_labels)
                needs_.emplace_back(label);
    }
    return {};
}

MachineConversation::Step MachineConversation::take_error(std::string_view message)
{
    auto refusal = announced_;
    auto const sentence = message.substr(error_prefix.size());
    if (auto const* const row = is_ours_ ? nullptr : pythons_refusal(sentence);
        row && refusal == MachineRefusal::none && row->where != StartRefusal::everywhere) {
        refusal = MachineRefusal::machine;
        last_reason_ = reason_message(row->code);
    }
    Step step;
    step.refusal = refusal;
    has_said_error_ = true;
    if (refusal == MachineRefusal::none)
        step.for_browser = message;
    else
        last_word_ = sentence;
    return step;
}

MachineRefusal MachineConversation::on_end() const noexcept
{
    if (is_ready_ || has_said_error_)
        return MachineRefusal::none;
    return announced_ == MachineRefusal::none ? MachineRefusal::silent : announced_;
}

Duration MachineConversation::patience() const noexcept
{
    if (promises_heartbeat_ || (is_ours_ && !is_ready_))
        return patience_with_ours;
    return is_ready_ ? Duration::max() : patience_with_others;
}

} // namespace webots_cloud::core
