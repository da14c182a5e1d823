// Reads typed values out of a JSON object and remembers the first thing that is wrong.
#pragma once

#include <webots_cloud/error.hpp>

#include <boost/json/object.hpp>

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace webots_cloud::core {

/// One configuration file being read. Every key that is requested counts as known.
class ConfigReader
{
public:
    /// Errors: `invalid_config` with line and column when `text` is no JSON, or no object.
    static result<ConfigReader> parse(std::string_view text, std::filesystem::path const& origin);

    bool has(std::string_view key) const { return object_.contains(key); }

    // Each leaves `value` alone when the key is absent. Strings and paths have no control characters: they
    // end up in requests, headers, command lines, environments and file names.
    void read(std::string_view key, std::string& value);
    void read(std::string_view key, bool& value);
    void read(std::string_view key, std::filesystem::path& value);
    void read(std::string_view key, std::vector<std::string>& value);
    /// For texts that are only ever shown, and for what the caller checks more strictly: any string.
    void read_text(std::string_view key, std::string& value);
    /// A secret string, which no message quotes.
    void read_secret(std::string_view key, std::string& value);
    void read_number(std::string_view key, double& value, double min, double max);
    void read_integer(std::string_view key, int& value, int min, int max);
    /// One of `choices`.
    void read_choice(std::string_view key, std::string& value, std::vector<std::string_view> const& choices);

    /// The value itself, for keys of other shapes; null when it is absent.
    boost::json::value const* find(std::string_view key);

    /// Declares keys that are known but not used here.
    void ignore(std::vector<std::string_view> const& keys);

    /// A reader of an object that is an entry of the list `key`; `number` counts from 1. Give it back to
    /// `take_over`.
    ConfigReader entry(std::string_view key, std::size_t number, boost::json::object const& object) const;
    /// What was wrong with an entry, and its unknown keys, as if they were ours.
    void take_over(ConfigReader const& entry);

    /// Notes that `key` is wrong: "expected <wanted>, found <what is there>".
    void refuse(std::string_view key, std::string_view wanted);
    /// The same of one entry of the list `key`; `number` counts from 1.
    void refuse_entry(std::string_view key, std::size_t number, boost::json::value const& entry,
                      std::string_view wanted);
    /// Notes that a required key is missing.
    void require(std::string_view key, std::string_view wanted);

    /// The first mistake, if any. To be called last: where a key is missing, it names the unknown ones,
    /// too.
    std::optional<Failure> failure() const;

    /// A warning for each key that was never requested, with the most similar known one.
    std::vector<std::string> unknown_keys() const;

private:
    explicit ConfigReader(std::string origin) : origin_(std::move(origin)) {}

    void fail(std::string_view what);
    std::vector<std::string> unknown() const;

    std::string origin_;
    std::string place_; ///< Of an entry: what its sentences begin with.
    boost::json::object object_;
    std::vector<std::string_view> known_;
    std::vector<std::string> unknown_within_; ///< Sentences, of entries.
    std::optional<Failure> failure_;
    bool misses_key_ = false; ///< That is the failure.
};

/// `text` with a leading `~` and each `$NAME` or `${NAME}` replaced from the environment, as Python's
/// expanduser and expandvars do; unknown variables stay.
std::string expand_path(std::string_view text);

} // namespace webots_cloud::core
