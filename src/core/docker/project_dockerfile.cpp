// Writes a Dockerfile anew from one that a stranger wrote: known instructions alone, each in one line, so
// that every version of docker reads what was checked here. docs/docker.md lists what is allowed.
#include "project_dockerfile.hpp"

#include "characters.hpp"
#include "core/refusals.hpp"
#include "core/text.hpp"
#include "labels.hpp"

#include <algorithm>
#include <array>
#include <map>
#include <optional>
#include <vector>

namespace webots_cloud::core {
namespace {

/// An instruction in one line.
struct Instruction
{
    std::string name; ///< In capital letters.
    std::string arguments;
    std::size_t line = 0; ///< Where it begins, from 1.
};

// ONBUILD would run what we have not read, in a stage that begins with this one.
constexpr std::array<std::string_view, 17> known = {
    "ADD",   "ARG",        "CMD", "COPY",  "ENTRYPOINT", "ENV",  "EXPOSE", "FROM",   "HEALTHCHECK",
    "LABEL", "MAINTAINER", "RUN", "SHELL", "STOPSIGNAL", "USER", "VOLUME", "WORKDIR"};

// Versions of docker differ on whether the next line belongs to it.
constexpr std::string_view two_backslashes = "it ends in two backslashes.";

std::vector<std::string_view> words_of(std::string_view text)
{
    std::vector<std::string_view> words;
    for (auto at = text.find_first_not_of(" \t"); at != std::string_view::npos;) {
        auto const end = std::min(text.find_first_of(" \t", at), text.size());
        words.push_back(text.substr(at, end - at));
        at = text.find_first_not_of(" \t", end);
    }
    return words;
}

std::string upper_case(std::string_view text)
{
    std::string upper(text);
    for (char& c : upper)
        c = c >= 'a' && c <= 'z' ? static_cast<char>(c - 'a' + 'A') : c;
    return upper;
}

/// `registry.example:5000/`: a name, and no address, since docker asks this machine's own services as well.
bool has_registry(std::string_view image)
{
    auto const host = image.substr(0, image.find('/'));
    auto const name = host.substr(0, host.find(':'));
    auto const port = host.substr(name.size());
    auto const dot = name.rfind('.');
    return host.size() + 1 < image.size() && consists_of(name, ".-") && !name.starts_with('.') &&
           dot != std::string_view::npos && dot + 1 < name.size() &&
           std::all_of(name.begin() + static_cast<std::ptrdiff_t>(dot) + 1, name.end(), is_letter) &&
           (port.empty() || parse_port(port.substr(1)) != 0) &&
           consists_of(image.substr(host.size() + 1), "_.-/:@");
}

bool is_of_repository(std::string_view image, std::string_view repository)
{
    if (!image.starts_with(repository))
        return false;
    auto const rest = image.substr(repository.size());
    return rest.empty() || ((rest.front() == ':' || rest.front() == '@') && rest.size() > 1 &&
                            consists_of(rest.substr(1), "_.-:"));
}

/// Reads a Dockerfile from its beginning to its end.
class Reader
{
public:
    Reader(std::string_view file, DockerfileTerms const& terms) : file_(file), terms_(terms)
    {
        values_["WEBOTS_DEFAULT_IMAGE"] = terms.default_image;
    }

    result<ProjectDockerfile> read(std::string_view text);

private:
    result<std::vector<Instruction>> instructions(std::string_view text) const;
    result<> add(Instruction const& instruction);
    result<std::string> from(Instruction const& instruction);
    result<> check_copy(Instruction const& instruction) const;
    result<> check_add(Instruction const& instruction) const;
    result<std::string_view> without_flags(Instruction const& instruction, bool may_copy) const;
    result<> check_source(std::string_view source, std::size_t line) const;
    void note_values(std::string_view arguments);
    std::optional<std::string> expanded(std::string_view text) const;
    Failure failure(std::size_t line, std::string_view reason) const;
    Failure image_failure(std::size_t line, std::string_view image) const;

    std::string_view file_;
    DockerfileTerms const& terms_;
    std::map<std::string, std::string, std::less<>> values_; ///< Of arguments before the first stage.
    std::vector<std::string> stages_;                        ///< That have ended; empty: without a name.
    std::optional<std::string> stage_;                       ///< The name of the one that has begun.
    ProjectDockerfile written_;
};

Failure Reader::failure(std::size_t line, std::string_view reason) const
{
    return refused(Refused::dockerfile_line,
                   {{"line", std::to_string(line)}, {"file", file_}, {"words", reason}});
}

Failure Reader::image_failure(std::size_t line, std::string_view image) const
{
    auto const named = printable(image, 100);
    bool const is_name =
        !image.empty() && consists_of(image, "_.-/:") && image.find("//") == std::string_view::npos;
    auto const advice = is_name ? concat("Write docker.io/",
                                         image.find('/') == std::string_view::npos ? "library/" : "", named)
                                : std::string("Write it as docker.io/<user>/<image>");
    return failure(line, concat("it names the image \"", named, "\" without its registry. ", advice,
                                ", or start from an image of ", terms_.images, "."));
}

result<std::vector<Instruction>> Reader::instructions(std::string_view text) const
{
    if (text.starts_with("\xEF\xBB\xBF"))
        text.remove_prefix(3);
    std::vector<Instruction> found;
    std::string joined;
    bool goes_on = false;
    std::size_t begin = 0;
    std::size_t number = 0;
    auto const take = [&] {
        auto const all = trim(joined);
        auto const end = std::min(all.find_first_of(" \t"), all.size());
        if (!all.empty()) {
            found.emplace_back();
            found.back().name = upper_case(all.substr(0, end));
            found.back().arguments = trim(all.substr(end));
            found.back().line = begin;
        }
        joined.clear();
    };
    for (auto line : split(text, '\n')) {
        ++number;
        while (line.ends_with('\r'))
            line.remove_suffix(1);
        if (std::any_of(line.begin(), line.end(),
                        [](char c) { return c != '\t' && static_cast<unsigned char>(c) < ' '; }))
            return failure(number, "it has control characters. Save the file as plain text.");
        // Comments, and empty lines within an instruction, are left out, as docker does.
        auto const words = trim(line);
        if (words.starts_with('#') || (goes_on && words.empty()))
            continue;
        if (!goes_on)
            begin = number;
        goes_on = words.ends_with('\\');
        if (words.ends_with("\\\\"))
            return failure(number, two_backslashes);
        joined.append(goes_on ? line.substr(0, line.rfind('\\')) : line);
        if (!goes_on)
            take();
    }
    take();
    return found;
}

result<ProjectDockerfile> Reader::read(std::string_view text)
{
    auto const found = instructions(text);
    if (!found)
        return found.error();
    for (auto const& instruction : *found)
        if (auto const added = add(instruction); !added)
            return added.error();
    return std::move(written_);
}

result<> Reader::add(Instruction const& instruction)
{
    auto const& [name, arguments, line] = instruction;
    if (std::find(known.begin(), known.end(), name) == known.end())
        return failure(
            line, concat("\"", printable(name, 60), "\" is not among the instructions that may be used."));
    if (arguments.ends_with('\\'))
        return failure(line, two_backslashes);
    bool const runs = name == "RUN" || name == "COPY" || name == "ADD";
    if (runs && arguments.find("<<") != std::string::npos)
        return failure(line, "it has a here-document (\"<<\"). Put the text into a file of the project.");
    auto text = arguments;
    result<> checked;
    if (name == "FROM") {
        auto stage = from(instruction);
        if (!stage)
            return stage.error();
        text = std::move(*stage);
    } else if (name == "COPY") {
        checked = check_copy(instruction);
    } else if (name == "ADD") {
        checked = check_add(instruction);
    } else if (name == "RUN" && arguments.starts_with("--")) {
        checked = failure(line, "RUN can't have options.");
    } else if (name == "ARG" && !stage_) {
        note_values(arguments);
    }
    if (!checked)
        return checked;
    written_.text.append(concat(name, " ", text, "\n"));
    if (name == "FROM" || name == "ENTRYPOINT" || name == "CMD")
        written_.says_what_to_start = name != "FROM";
    // Of two labels with one name the last one counts: ours, so that a project can't pass its image off as
    // another's.
    if (name == "FROM" || name == "LABEL")
        written_.text.append(concat("LABEL ", server_label, "=", terms_.server, " ", project_label,
                                    "=\"\" com.docker.compose.service=\"\"\n"));
    return {};
}

/// The arguments of FROM, with the name of the image in place of variables.
result<std::string> Reader::from(Instruction const& instruction)
{
    auto words = words_of(instruction.arguments);
    std::string text;
    if (!words.empty() && words.front().starts_with("--")) {
        if (!words.front().starts_with("--platform=") || !consists_of(words.front(), "-=/._"))
            return failure(instruction.line, "FROM can have no option but --platform.");
        text = concat(words.front(), " ");
        words.erase(words.begin());
    }
    bool const is_named = words.size() == 3 && lower_case(words[1]) == "as";
    if (words.size() != 1 && !is_named)
        return failure(instruction.line, "it names no image. Expected, for instance: FROM scratch AS build");
    auto const name = is_named ? lower_case(words[2]) : std::string();
    if (is_named && !(is_letter(name.front()) && consists_of(name, "-_.")))
        return failure(instruction.line,
                       "the name of the stage has other characters than letters and digits.");
    auto image = expanded(words[0]);
    if (!image)
        return failure(instruction.line, concat("\"", printable(words[0], 100),
                                                "\" has no value here. Write the name of the image itself."));
    // The stage before this one has ended: this one may be based on it, and not on itself.
    if (stage_)
        stages_.push_back(std::move(*stage_));
    stage_ = name;
    bool const is_stage = std::find(stages_.begin(), stages_.end(), lower_case(*image)) != stages_.end();
    if (!is_stage && *image != "scratch" && !is_of_repository(*image, terms_.images) && !has_registry(*image))
        return image_failure(instruction.line, *image);
    if (!is_stage && *image != "scratch" && !is_of_repository(*image, terms_.images))
        written_.bases.push_back(*image);
    text.append(is_stage ? lower_case(*image) : *image);
    if (is_named)
        text.append(" AS ").append(name);
    return text;
}

result<> Reader::check_source(std::string_view source, std::size_t line) const
{
    bool const is_number =
        !source.empty() && source.size() < 4 && std::all_of(source.begin(), source.end(), is_digit);
    // That of the stage itself is none yet: docker would take it for an image's.
    bool const is_stage =
        is_number ? std::stoul(std::string(source)) < stages_.size()
                  : std::find(stages_.begin(), stages_.end(), lower_case(source)) != stages_.end();
    if (is_stage || is_of_repository(source, terms_.images) || has_registry(source))
        return {};
    return image_failure(line, source);
}

/// The arguments after the options, which are those that we know.
result<std::string_view> Reader::without_flags(Instruction const& instruction, bool may_copy) const
{
    std::string_view rest = instruction.arguments;
    while (rest.starts_with("--")) {
        auto const flag = rest.substr(0, rest.find_first_of(" \t"));
        auto const name = flag.substr(0, flag.find('='));
        bool const is_known = name == "--chown" || name == "--chmod" || (may_copy && name == "--from");
        if (!is_known || !consists_of(flag, "-=:_./@+"))
            return failure(instruction.line, concat("\"", printable(flag, 100),
                                                    "\" is not among the options that may be used."));
        if (name == "--from")
            if (auto const checked =
                    check_source(flag.substr(std::min(name.size() + 1, flag.size())), instruction.line);
                !checked)
                return checked.error();
        rest = trim(rest.substr(flag.size()));
    }
    return rest;
}

result<> Reader::check_copy(Instruction const& instruction) const
{
    auto const rest = without_flags(instruction, true);
    return rest ? result<>() : result<>(rest.error());
}

/// Docker itself would fetch what is no file of the project, with all that this machine reaches.
result<> Reader::check_add(Instruction const& instruction) const
{
    auto const rest = without_flags(instruction, false);
    if (!rest)
        return rest.error();
    if (rest->find_first_of(":$") != std::string_view::npos)
        return failure(instruction.line, "ADD takes files of the project alone. Fetch others with RUN.");
    return {};
}

/// What FROM can refer to: `NAME=value`, also in quotes.
void Reader::note_values(std::string_view arguments)
{
    for (auto const word : words_of(arguments)) {
        auto const equals = word.find('=');
        if (equals == std::string_view::npos)
            continue;
        auto value = word.substr(equals + 1);
        if (value.size() > 1 && (value.front() == '"' || value.front() == '\'') &&
            value.back() == value.front())
            value = value.substr(1, value.size() - 2);
        auto const name = word.substr(0, equals);
        if (auto known_value = expanded(value); known_value && name != "WEBOTS_DEFAULT_IMAGE")
            values_[std::string(name)] = std::move(*known_value);
    }
}

/// With the values of `$NAME` and `${NAME}`.   Nothing: one has none, or is written otherwise.
std::optional<std::string> Reader::expanded(std::string_view text) const
{
    std::string all;
    while (!text.empty()) {
        auto const dollar = std::min(text.find('$'), text.size());
        all.append(text.substr(0, dollar));
        text.remove_prefix(dollar);
        if (text.empty())
            break;
        text.remove_prefix(1);
        bool const braced = text.starts_with('{');
        if (braced)
            text.remove_prefix(1);
        auto const end = std::find_if(text.begin(), text.end(),
                                      [](char c) { return !is_letter(c) && !is_digit(c) && c != '_'; });
        auto const name = text.substr(0, static_cast<std::size_t>(end - text.begin()));
        text.remove_prefix(name.size());
        auto const value = values_.find(name);
        if (value == values_.end() || (braced && !text.starts_with('}')))
            return std::nullopt;
        if (braced)
            text.remove_prefix(1);
        all.append(value->second);
    }
    return all;
}

} // namespace

result<ProjectDockerfile> project_dockerfile(std::string_view text, std::string_view file,
                                             DockerfileTerms const& terms)
{
    return Reader(file, terms).read(text);
}

std::vector<std::string> list_triggers(std::string_view image)
{
    return {"image", "inspect", "--format", "{{json .Config.OnBuild}}", std::string(image)};
}

bool has_triggers(std::string_view listing)
{
    auto const list = trim(listing);
    return list != "null" && list != "[]";
}

} // namespace webots_cloud::core
