// Simulators that answer what the test says.
#pragma once

#include <webots_cloud/transport/simulator_talk.hpp>

#include <string>
#include <utility>
#include <vector>

namespace webots_cloud::testing {

/// Every simulator gives the same answers.
class FixedSimulatorTalk final : public SimulatorTalk
{
public:
    boost::asio::awaitable<std::vector<std::string>> talk(Upstream simulator, std::vector<std::string> words,
                                                          std::string) override
    {
        asked.push_back(std::move(simulator));
        said.push_back(std::move(words));
        co_return answers;
    }

    std::vector<std::string> answers;
    std::vector<Upstream> asked;                ///< In order.
    std::vector<std::vector<std::string>> said; ///< Likewise, what each was told.
};

} // namespace webots_cloud::testing
