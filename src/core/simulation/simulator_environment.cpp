// A variable passes if its name is on a list of what programs need, or the operator names it. Names that
// sound like secrets, and addresses with passwords in them, pass only by name: the lists can't foresee what
// operators export. Remarks tell them what was left out.
#include "simulator_environment.hpp"

#include "core/text.hpp"

#include <algorithm>
#include <array>
#include <map>

namespace webots_cloud::core {
namespace {

template<std::size_t Size>
using Names = std::array<std::string_view, Size>;

constexpr auto needed = std::to_array<std::string_view>(
    {// who, where, and the screen
     "HOME", "HOSTNAME", "LOGNAME", "PATH", "SHELL", "TERM", "TMPDIR", "USER", "WAYLAND_DISPLAY",
     "XAUTHORITY",
     // locale and time zone
     "LANG", "LANGUAGE", "LOCPATH", "NLSPATH", "TZ", "TZDIR",
     // libraries and languages
     "CLASSPATH", "JAVA_HOME", "JAVA_OPTS", "JAVA_TOOL_OPTIONS", "LD_LIBRARY_PATH", "LD_PRELOAD",
     "LM_LICENSE_FILE", "MATLABPATH", "MLM_LICENSE_FILE", "NODE_PATH", "VIRTUAL_ENV",
     // ROS
     "CMAKE_PREFIX_PATH", "NDDSHOME", "PKG_CONFIG_PATH",
     // certificates
     "CURL_CA_BUNDLE", "NODE_EXTRA_CA_CERTS", "REQUESTS_CA_BUNDLE", "SSL_CERT_DIR", "SSL_CERT_FILE",
     // drivers
     "DRI_PRIME", "VDPAU_DRIVER"});

constexpr auto needed_prefixes = std::to_array<std::string_view>(
    {"LC_", "WEBOTS_", "XDG_",
     // languages, and libraries for numbers
     "CONDA_", "MATLAB_", "MKL_", "OMP_", "OPENBLAS_", "PYTHON",
     // ROS and its middleware
     "AMENT_", "COLCON_", "CYCLONEDDS_", "FASTDDS_", "FASTRTPS_", "RCL_", "RCUTILS_", "RMW_", "ROSCONSOLE_",
     "ROSLISP_", "ROS_", "ZENOH_",
     // graphics: toolkits, drivers, remote screens
     "CUDA_", "EGL_", "FONTCONFIG_", "GALLIUM_", "GBM_", "GDK_", "GTK_", "HIP_", "LIBGL_", "LIBVA_", "LP_",
     "MESA_", "NVIDIA_", "QT_", "ROCR_", "VGL_", "VK_", "XCURSOR_", "__EGL_", "__GLVND_", "__GLX_", "__GL_",
     "__NV_", "__VK_",
     // sound
     "ALSA_", "PIPEWIRE_", "PULSE_", "SDL_"});

// In both cases.
constexpr auto proxies =
    std::to_array<std::string_view>({"all_proxy", "ftp_proxy", "http_proxy", "https_proxy", "no_proxy"});

// What systemd sets for this service only. Programs that have it could speak to systemd in the server's name.
constexpr auto servers_own = std::to_array<std::string_view>({"CACHE_DIRECTORY",
                                                              "CONFIGURATION_DIRECTORY",
                                                              "CREDENTIALS_DIRECTORY",
                                                              "EXIT_CODE",
                                                              "EXIT_STATUS",
                                                              "FDSTORE",
                                                              "INVOCATION_ID",
                                                              "JOURNAL_STREAM",
                                                              "LISTEN_FDNAMES",
                                                              "LISTEN_FDS",
                                                              "LISTEN_PID",
                                                              "LISTEN_PIDFDID",
                                                              "LOGS_DIRECTORY",
                                                              "MAINPID",
                                                              "MANAGERPID",
                                                              "MANAGERPIDFDID",
                                                              "MEMORY_PRESSURE_WATCH",
                                                              "MEMORY_PRESSURE_WRITE",
                                                              "NOTIFY_SOCKET",
                                                              "RUNTIME_DIRECTORY",
                                                              "SERVICE_RESULT",
                                                              "STATE_DIRECTORY",
                                                              "SYSTEMD_EXEC_PID",
                                                              "WATCHDOG_PID",
                                                              "WATCHDOG_USEC"});

// Internal variables of shells, of no use to other programs.
constexpr auto shells_own = std::to_array<std::string_view>({"OLDPWD", "PWD", "SHLVL", "_"});

constexpr auto secret_words = std::to_array<std::string_view>(
    {"APIKEY", "CREDENTIAL", "PASSPHRASE", "PASSW", "PRIVATE", "SECRET", "TOKEN"});
constexpr auto secret_parts =
    std::to_array<std::string_view>({"AUTH", "KEY", "KEYS", "PASS", "PWD"}); // between underscores

constexpr std::size_t max_name_length = 256;
constexpr std::size_t max_value_length = 32 * 1024; // the kernel takes four times as much in one variable
constexpr std::size_t max_listed = 20;

template<std::size_t Size>
bool contains(Names<Size> const& names, std::string_view name)
{
    return std::find(names.begin(), names.end(), name) != names.end();
}

std::string in_case(std::string_view text, char first, char last, int distance)
{
    std::string changed(text);
    for (auto& c : changed)
        if (c >= first && c <= last)
            c = static_cast<char>(c + distance);
    return changed;
}

std::string upper(std::string_view text)
{
    return in_case(text, 'a', 'z', 'A' - 'a');
}

bool is_proxy(std::string_view name)
{
    auto const lower = in_case(name, 'A', 'Z', 'a' - 'A');
    return (name == lower || name == upper(name)) && contains(proxies, lower);
}

bool is_needed(std::string_view name)
{
    return contains(needed, name) || is_proxy(name) ||
           std::any_of(needed_prefixes.begin(), needed_prefixes.end(),
                       [&](std::string_view prefix) { return name.starts_with(prefix); });
}

bool sounds_secret(std::string_view name)
{
    if (contains(needed, name))
        return false;
    auto const capitals = upper(name);
    auto const parts = split(capitals, '_');
    auto const is_in_name = [&](std::string_view word) { return capitals.find(word) != std::string::npos; };
    auto const is_part = [&](std::string_view word) {
        return std::find(parts.begin(), parts.end(), word) != parts.end();
    };
    return std::any_of(secret_words.begin(), secret_words.end(), is_in_name) ||
           std::any_of(secret_parts.begin(), secret_parts.end(), is_part);
}

/// Whether `text` has a name and a password in front of an `@`.
bool has_password(std::string_view text)
{
    auto const at = text.rfind('@');
    return at != std::string_view::npos && text.substr(0, at).find(':') != std::string_view::npos;
}

/// Whether an address in `value` has a password. Of proxies, which may be written without `http://`, all that
/// may be one counts.
bool holds_password(std::string_view name, std::string_view value)
{
    auto scheme = value.find("://");
    if (is_proxy(name))
        return has_password(scheme == std::string_view::npos ? value : value.substr(scheme + 3));
    for (; scheme != std::string_view::npos; scheme = value.find("://")) {
        value.remove_prefix(scheme + 3);
        if (has_password(value.substr(0, value.find_first_of("/?# "))))
            return true;
    }
    return false;
}

/// Whether a variable may be passed on without being named.
bool is_harmless(std::string_view name, std::string_view value)
{
    return !contains(servers_own, name) && !contains(shells_own, name) && !sounds_secret(name) &&
           !holds_password(name, value);
}

bool is_name(std::string_view text)
{
    auto const is_letter = [](char c) {
        return c == '_' || (c >= 'A' && c <= 'Z') || (c >= 'a' && c <= 'z');
    };
    return !text.empty() && text.size() <= max_name_length && is_letter(text.front()) &&
           std::all_of(text.begin(), text.end(),
                       [&](char c) { return is_letter(c) || (c >= '0' && c <= '9'); });
}

/// `PREFIX_*` or `*`, and not `NAME=a*`.
bool is_pattern(std::string_view entry)
{
    return entry.ends_with('*') && entry.find('=') == std::string_view::npos;
}

bool matches(std::string_view pattern, std::string_view name)
{
    pattern.remove_suffix(1);
    return name.starts_with(pattern) && is_name(name);
}

Environment::const_iterator find(Environment const& environment, std::string_view name)
{
    return std::find_if(environment.begin(), environment.end(),
                        [name](auto const& variable) { return variable.first == name; });
}

bool has(Environment const& environment, std::string_view name)
{
    return find(environment, name) != environment.end();
}

std::string listed(std::vector<std::string_view> names)
{
    constexpr std::size_t longest = 60;
    std::sort(names.begin(), names.end());
    auto const shown = std::min(names.size(), max_listed);
    std::string text;
    for (std::size_t i = 0; i < shown; ++i)
        text += concat(i == 0 ? "" : ", ", printable(names[i], longest));
    if (names.size() > shown)
        text += concat(" and ", std::to_string(names.size() - shown), " more");
    return text;
}

} // namespace

std::string_view wanted_instead(std::string_view entry)
{
    auto const name = name_of_entry(entry);
    bool const sets = name.size() < entry.size();
    if (is_pattern(entry) && (entry.size() == 1 || is_name(entry.substr(0, entry.size() - 1))))
        return {};
    if (!is_name(name))
        return "the name of a variable, the beginning of one as in \"ROS_*\", or \"NAME=value\"";
    if (contains(servers_own, name))
        return "no variable that systemd gives to this server alone";
    if (name == "DISPLAY" && sets)
        return "no value for DISPLAY: the key \"display\" sets it";
    if (entry.size() > max_value_length)
        return "at most 32768 characters";
    return {};
}

std::string_view name_of_entry(std::string_view entry)
{
    return entry.substr(0, entry.find('='));
}

std::string value_of(Environment const& environment, std::string_view name)
{
    for (auto const& [each, value] : environment)
        if (each == name)
            return value;
    return {};
}

void set_variable(Environment& environment, std::string_view name, std::string_view value)
{
    auto const same = [name](auto const& variable) { return variable.first == name; };
    auto const found = std::find_if(environment.begin(), environment.end(), same);
    if (found == environment.end())
        environment.emplace_back(name, value);
    else
        found->second = value;
}

void remove_variable(Environment& environment, std::string_view name)
{
    std::erase_if(environment, [name](auto const& variable) { return variable.first == name; });
}

Environment named_environment(Environment const& ours, std::vector<std::string> const& entries)
{
    std::map<std::string_view, std::string_view> given;
    for (auto const& variable : ours) {
        auto const finds_it = [&variable](std::string_view entry) {
            return is_pattern(entry) && matches(entry, variable.first);
        };
        if (is_harmless(variable.first, variable.second) &&
            std::any_of(entries.begin(), entries.end(), finds_it))
            given[variable.first] = variable.second;
    }
    for (std::string_view const entry : entries) {
        auto const name = name_of_entry(entry);
        if (name.size() < entry.size())
            given[name] = entry.substr(name.size() + 1);
        else if (auto const found = find(ours, name); found != ours.end())
            given[name] = found->second;
    }
    return {given.begin(), given.end()};
}

Environment simulator_environment(Environment const& ours, std::vector<std::string> const& entries,
                                  std::string_view display)
{
    Environment environment;
    for (auto const& [name, value] : ours)
        if (is_needed(name) && is_harmless(name, value))
            environment.emplace_back(name, value);
    for (auto const& [name, value] : named_environment(ours, entries))
        set_variable(environment, name, value);
    if (!display.empty()) {
        set_variable(environment, "DISPLAY", display);
        return environment;
    }
    for (auto const* name : {"DISPLAY", "WAYLAND_DISPLAY", "XAUTHORITY"})
        remove_variable(environment, name);
    return environment;
}

EnvironmentRemarks environment_remarks(Environment const& ours, std::vector<std::string> const& entries)
{
    EnvironmentRemarks remarks;
    auto const passed = simulator_environment(ours, entries, ":0");
    std::vector<std::string_view> left_out;
    std::vector<std::string_view> with_password;
    for (auto const& [name, value] : ours) {
        if (has(passed, name) || contains(servers_own, name) || contains(shells_own, name))
            continue;
        bool const is_missed = is_needed(name) && holds_password(name, value);
        (is_missed ? with_password : left_out).push_back(name);
    }
    std::vector<std::string_view> missing;
    for (std::string_view const entry : entries)
        if (is_name(entry) && !has(ours, entry))
            missing.push_back(entry);
    if (!left_out.empty())
        remarks.notices.push_back(
            concat("Simulators do not get these variables of the server's environment: ",
                   listed(std::move(left_out)), ". To pass one on, name it in \"simulatorEnvironment\"."));
    if (!with_password.empty())
        remarks.warnings.push_back(
            concat("Simulators do not get ", listed(std::move(with_password)),
                   ": there is a password in it, which their programs could read. If they may, name it in "
                   "\"simulatorEnvironment\"."));
    if (!missing.empty())
        remarks.warnings.push_back(concat("\"simulatorEnvironment\" names ", listed(std::move(missing)),
                                          ", which the server's own environment does not have."));
    return remarks;
}

} // namespace webots_cloud::core
