// Machines that a session server asks for a report before it places a session, so that it knows whom others
// have placed there.
#pragma once

#include <webots_cloud/time.hpp>

#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <vector>

namespace webots_cloud::core {

/// Which browser waits for the answer of which machine.
///
/// A machine is asked once, however many browsers wait for its answer, none of them for longer than
/// `patience`. One that has not answered in that time is not asked for 10 s, so it delays those few who came
/// first, and nobody else.
class MachineQuestions
{
public:
    using Asker = std::uint64_t;

    enum class Verdict
    {
        ask,  ///< Its answer is to be asked and waited for,
        wait, ///< only waited for, as it was asked a moment ago,
        pass  ///< or it rests.
    };

    Verdict ask(std::string_view entry, Asker asker, TimePoint now);
    /// It has not answered yet, and still may in time.
    bool is_open(std::string_view entry) const;
    /// It has answered, or could not be reached. Returns who waited for that; some may have left since.
    std::vector<Asker> answered(std::string_view entry);
    /// Somebody does not wait for its answer any longer.
    void give_up(std::string_view entry, TimePoint now);
    /// It has left the list.
    void forget(std::string_view entry);

    static constexpr Duration patience = std::chrono::milliseconds(200);
    static constexpr Duration pause = std::chrono::seconds(10);

private:
    struct Question
    {
        Question() = default;

        bool is_open = false;
        TimePoint asked_at{};
        TimePoint rests_until = TimePoint::min();
        std::vector<Asker> askers;
    };

    std::map<std::string, Question, std::less<>> machines_;
};

} // namespace webots_cloud::core
