// What running servers say of themselves when they are asked.
#pragma once

#include "settings.hpp"

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace webots_cloud::site {

/// Whether it answers at all, whatever it says.
bool answers(Settings const& settings);

/// Whether a session server could place a session now.
bool has_room(Settings const& settings);

/// What of the walls around the simulations of a simulation server is weaker than people may expect, as it
/// says itself; empty: nothing is, or it does not say.
std::string weakness(Settings const& settings);

/// The same from the answer to `/readyz`.
std::string parse_weakness(std::string_view readyz);

/// What `status` shows below a server's address and logs, a line each, without the margin.
std::vector<std::string> state_lines(Settings const& settings);

/// `seats          3 of 100 taken`, from the answer to `/load`; nothing: it does not say.
std::optional<std::string> seats_line(std::string_view load);

/// What visitors meet, and why machines refused them, from the answer to `/monitor`; nothing where that has a
/// password.
std::vector<std::string> visitor_lines(std::string_view monitor);

} // namespace webots_cloud::site
