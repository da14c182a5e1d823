// Reads typed values out of the JSON object of a configuration, as the table of keys describes them, and
// remembers everything that is wrong.
#pragma once

#include "config_keys.hpp"
#include "positioned_json.hpp"

#include <webots_cloud/error.hpp>

#include <boost/json/object.hpp>

#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace webots_cloud::core {

/// The keys of the other server, which people give by mistake.
struct OtherServer
{
    std::string_view name;
    std::span<ConfigTopic const> topics = {};
};

/// One configuration file being read. A caller that asks for a key that the table lacks, or of another type,
/// or doesn't ask for all of them, gets a `std::logic_error`.
class ConfigReader
{
public:
    /// What is no JSON is noted as a fault, too. Errors: `invalid_config` when `text` has no object.
    static result<ConfigReader> parse(std::string_view text, std::filesystem::path const& origin,
                                      std::span<ConfigTopic const> topics, OtherServer const& other = {});

    bool has(std::string_view key) const { return object_.contains(key); }

    /// Reads every key that a member of `owner` keeps (`KeyValue::read`). The table has to be the one of that
    /// struct.
    template<class Owner>
    void read_members(Owner& owner)
    {
        read_members(&owner_tag<Owner>, &owner);
    }

    // Each leaves `value` alone when the key is absent. Strings and paths have no control characters: they
    // end up in requests, headers, command lines, environments and file names. Ranges and choices are those
    // of the table.
    void read(std::string_view key, std::string& value);
    void read(std::string_view key, bool& value);
    void read(std::string_view key, std::filesystem::path& value);
    void read(std::string_view key, std::vector<std::string>& value);
    /// For texts that are only ever shown, and for what the caller checks more strictly: any string.
    void read_text(std::string_view key, std::string& value);
    void read_number(std::string_view key, double& value);
    /// `highest`: where other keys leave less than the table allows.
    void read_integer(std::string_view key, int& value, std::optional<int> highest = {});
    void read_choice(std::string_view key, std::string& value);

    /// The value itself, for keys of other shapes; null when it is absent.
    boost::json::value const* find(std::string_view key);

    /// A reader of an object that is an entry of the list `key`; `number` counts from 1. Give it back to
    /// `take_over`.
    ConfigReader entry(std::string_view key, std::size_t number, boost::json::object const& object) const;
    /// The same for the object that is the value of `key`.
    ConfigReader inside(std::string_view key, boost::json::object const& object) const;
    /// What was wrong with an entry, and its unknown keys, as if they were ours.
    void take_over(ConfigReader const& entry);

    // Of faults in one place the first is kept: the others usually follow from it.

    /// Notes that `key` is wrong: "expected <wanted>, found <what is there><advice>".
    void refuse(std::string_view key, std::string_view wanted, std::string_view advice = {});
    /// The same of one entry of the list `key`; `number` counts from 1.
    void refuse_entry(std::string_view key, std::size_t number, boost::json::value const& entry,
                      std::string_view wanted, std::string_view advice = {});
    /// Notes what is odd about `key`, which is allowed all the same.
    void warn(std::string_view key, std::string_view sentence);
    void warn_entry(std::string_view key, std::size_t number, std::string_view sentence);
    /// Notes that a required key is missing.
    void require(std::string_view key, std::string_view wanted);

    /// Whether the value of `key` was refused.
    bool is_refused(std::string_view key) const;

    /// Everything that is wrong, if anything, a line each: first what is no JSON, then wrong values in the
    /// order of the file, missing keys, and what is ignored: unknown keys may be missing ones under a wrong
    /// name. To be called last.
    std::optional<Failure> failure() const;

    /// A warning for each key that there is twice, for each unknown one, with the most similar known one, and
    /// for what is odd.
    std::vector<std::string> warnings() const;

private:
    /// A sentence about a place in the file.
    struct Remark
    {
        std::size_t offset = 0;
        std::string text;
    };

    ConfigReader() = default;

    void read_members(void const* tag, void* owner);
    ConfigReader part(std::string_view key, boost::json::object const& object, JsonPlace const& place,
                      std::string context) const;
    std::string line(Remark const& remark, TextPlaces& places) const;
    ConfigKey const& described(std::string_view key) const;
    boost::json::value const* find(std::string_view key, std::initializer_list<KeyType> types);
    JsonPlace const& place_of(std::string_view key) const;
    void fail(std::size_t offset, std::string_view what);
    void refuse_number(ConfigKey const& key, boost::json::value const& found, std::string_view kind,
                       double max);
    void check_all_are_read() const;
    std::vector<Remark> unknown() const;
    std::vector<Remark> ignored() const; ///< Unknown keys, and those that there are twice.

    std::shared_ptr<PositionedJson const> json_; ///< Of the whole file.
    std::shared_ptr<std::string const> text_;
    /// What to write instead of numbers with units that are no JSON, by their places; of all parts together.
    std::shared_ptr<std::map<std::size_t, std::string>> advice_;
    std::string origin_;
    std::string context_; ///< Of a part: what its sentences begin with.
    std::vector<ConfigKey const*> keys_;
    OtherServer other_;
    JsonPlace const* place_ = nullptr;
    boost::json::object object_;
    std::vector<std::string_view> read_;
    std::vector<Remark> unknown_within_; ///< Of entries.
    std::vector<Remark> odd_;
    std::vector<Remark> wrong_;
    std::vector<Remark> missing_;
};

/// `text` with a leading `~` and each `$NAME` or `${NAME}` replaced from the environment, as Python's
/// expanduser and expandvars do; unknown variables stay.
std::string expand_path(std::string_view text);

/// What to write instead of a string where a list is wanted, as the end of a sentence; of others nothing.
std::string list_advice(boost::json::value const& found);

/// A number as people write it: `5`, `0.1`, `1000000000000`.
std::string number_text(double value);

} // namespace webots_cloud::core
