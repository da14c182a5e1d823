// What projects say to docker mode: nothing of it adds a line or a word to what compose is told.
#include "fuzz.hpp"

#include "core/docker/compose_output.hpp"
#include "core/docker/docker_project.hpp"
#include "core/docker/project_dockerfile.hpp"
#include "core/text.hpp"

using namespace webots_cloud;

namespace {

bool is_key_of_env_file(std::string_view key)
{
    static auto const keys =
        core::split("IMAGE,PROJECT_PATH,MAKE,PORT,COMPOSE_PROJECT_NAME,WEBOTS,DISPLAY,SERVER,RUNTIME,"
                    "GRAPHICS_DEVICE,PORT_PREFIX,THEIA_VOLUME,THEIA_PORT",
                    ',');
    return std::find(keys.begin(), keys.end(), key) != keys.end();
}

void check_env_file(core::DockerEnvironment const& environment)
{
    auto const file = core::env_file(environment);
    if (!file) {
        fuzz::require(!file.error().message().empty());
        return;
    }
    auto const lines = core::split(*file, '\n');
    bool const standard = environment.yml.kind == core::ComposeTemplate::standard;
    fuzz::require(lines.size() == (standard ? 12u : 14u) && lines.back().empty());
    for (std::size_t i = 0; i + 1 < lines.size(); ++i)
        fuzz::require(is_key_of_env_file(lines[i].substr(0, lines[i].find('='))));
    fuzz::require(file->find('$') == std::string::npos);
    // One value is quoted; a world with an apostrophe has quotes of its own in it, which backslashes precede.
    int ends = 0;
    int inner = 0;
    for (std::size_t i = 0; i < file->size(); ++i) {
        bool const is_escaped = i > 0 && file->at(i - 1) == '\\';
        fuzz::require(!is_escaped || file->at(i) == '"');
        if (file->at(i) == '"')
            ++(is_escaped ? inner : ends);
    }
    fuzz::require(ends == 2 && (inner == 0 || inner == 2));
}

/// The editor's folder stays below `/usr/local/`: dots in a name, as of `a..b/`, lead nowhere else.
void check_folder(core::WebotsYml const& yml)
{
    fuzz::require(yml.volume.empty() == (yml.kind == core::ComposeTemplate::standard));
    fuzz::require(!yml.volume.starts_with('/'));
    for (auto const part : core::split(yml.volume, '/'))
        fuzz::require(part != "..");
}

/// Each line is an instruction of its own, and each image that it names may be named.
void check_dockerfile(std::string_view text)
{
    core::DockerfileTerms terms;
    terms.images = "r/i";
    terms.default_image = "r/i:1";
    terms.server = "s";
    auto const dockerfile = core::project_dockerfile(text, "Dockerfile", terms);
    if (!dockerfile) {
        fuzz::require(core::is_utf8(dockerfile.error().message()));
        return;
    }
    auto lines = core::split(dockerfile->text, '\n');
    fuzz::require(lines.back().empty());
    lines.pop_back();
    std::vector<std::string> stages;
    for (auto const line : lines) {
        fuzz::require(line.front() >= 'A' && line.front() <= 'Z' && !line.ends_with('\\'));
        fuzz::require(line.find_first_of("\r\f\v") == std::string_view::npos);
        auto const words = core::split(line, ' ');
        if (words[0] != "FROM")
            continue;
        auto const image = words.at(words[1].starts_with("--") ? 2 : 1);
        bool const is_stage = std::find(stages.begin(), stages.end(), image) != stages.end();
        fuzz::require(is_stage || image == "scratch" || image == "r/i" || image.starts_with("r/i:") ||
                      image.starts_with("r/i@") || image.substr(0, image.find('/')).find('.') < image.size());
        if (words[words.size() - 2] == "AS")
            stages.emplace_back(words.back());
    }
}

} // namespace

int LLVMFuzzerTestOneInput(std::uint8_t const* data, std::size_t size)
{
    auto rest = fuzz::text_of(data, size);
    auto const world = fuzz::take(rest, fuzz::take_byte(rest));
    auto const header = fuzz::take(rest, fuzz::take_byte(rest));
    core::DockerEnvironment environment;
    if (auto const yml = core::parse_webots_yml(rest)) {
        environment.yml = *yml;
        check_folder(*yml);
        for (auto const& message : yml->messages)
            fuzz::require(message == "ide: enable" || message.starts_with("type:"));
    } else {
        fuzz::require(core::is_utf8(yml.error().message()));
    }
    if (auto const image = core::default_docker_image("r/i", header))
        environment.image = *image;
    environment.world = world;
    check_env_file(environment);
    check_dockerfile(rest);
    for (auto const line : core::split(rest, '\n')) {
        auto const parsed = core::parse_compose_line(line, header);
        fuzz::require(parsed.text.size() <= line.size());
    }
    return 0;
}
