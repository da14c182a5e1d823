#include "machine_questions.hpp"

#include <utility>

namespace webots_cloud::core {

MachineQuestions::Verdict MachineQuestions::ask(std::string_view entry, Asker asker, TimePoint now)
{
    auto& question = machines_[std::string(entry)];
    if (now < question.rests_until)
        return Verdict::pass;
    question.askers.push_back(asker);
    if (std::exchange(question.is_open, true))
        return Verdict::wait;
    question.asked_at = now;
    return Verdict::ask;
}

bool MachineQuestions::is_open(std::string_view entry) const
{
    auto const found = machines_.find(entry);
    return found != machines_.end() && found->second.is_open;
}

std::vector<MachineQuestions::Asker> MachineQuestions::answered(std::string_view entry)
{
    auto const found = machines_.find(entry);
    if (found == machines_.end())
        return {};
    found->second.is_open = false;
    return std::exchange(found->second.askers, {});
}

void MachineQuestions::give_up(std::string_view entry, TimePoint now)
{
    auto const found = machines_.find(entry);
    if (found == machines_.end() || !found->second.is_open || now - found->second.asked_at < patience)
        return;
    found->second.is_open = false;
    found->second.rests_until = now + pause;
}

void MachineQuestions::forget(std::string_view entry)
{
    if (auto const found = machines_.find(entry); found != machines_.end())
        machines_.erase(found);
}

} // namespace webots_cloud::core
