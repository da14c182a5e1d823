// Reads what pages of a class say, and writes what they are told. Only the form is judged here: what a
// message may do is decided by class_book.cpp. The fields are those of protocol section 13.15.
#include "class_messages.hpp"

#include "class_limits.hpp"
#include "class_text.hpp"
#include "core/simulation/editable_files.hpp"
#include "core/text.hpp"

#include <boost/json/array.hpp>
#include <boost/json/object.hpp>
#include <boost/json/parse.hpp>
#include <boost/json/serialize.hpp>

#include <algorithm>
#include <array>
#include <utility>

namespace webots_cloud::core {
namespace {

namespace json = boost::json;

constexpr std::array<std::pair<std::string_view, StudentState>, 9> states{{
    {"joined", StudentState::joined},
    {"starting", StudentState::starting},
    {"running", StudentState::running},
    {"paused", StudentState::paused},
    {"waiting", StudentState::waiting},
    {"hidden", StudentState::hidden},
    {"lost", StudentState::lost},
    {"ended", StudentState::ended},
    {"away", StudentState::away},
}};

constexpr std::array<std::pair<std::string_view, StudentSign>, 3> signs{{
    {"none", StudentSign::none},
    {"hand", StudentSign::hand},
    {"done", StudentSign::done},
}};

constexpr std::array<std::pair<std::string_view, ClassAction>, 10> actions{{
    {"pause", ClassAction::pause},
    {"run", ClassAction::run},
    {"reset", ClassAction::reset},
    {"end", ClassAction::end},
    {"start", ClassAction::start},
    {"lower", ClassAction::lower},
    {"message", ClassAction::message},
    {"program", ClassAction::program},
    {"take", ClassAction::take},
    {"remove", ClassAction::remove},
}};

/// Null: there is no such name.
template<class Value, std::size_t size>
Value const* find_value(std::array<std::pair<std::string_view, Value>, size> const& table,
                        json::string const* name)
{
    auto const found = std::find_if(table.begin(), table.end(), [name](auto const& row) {
        return name && row.first == std::string_view(*name);
    });
    return found == table.end() ? nullptr : &found->second;
}

template<class Value, std::size_t size>
std::string_view name_of(std::array<std::pair<std::string_view, Value>, size> const& table, Value value)
{
    return std::find_if(table.begin(), table.end(), [value](auto const& row) { return row.second == value; })
        ->first;
}

/// A member that is a string; anything else: null.
json::string const* string_in(json::object const& object, std::string_view key)
{
    auto const* value = object.if_contains(key);
    return value ? value->if_string() : nullptr;
}

std::optional<std::int64_t> read_integer(json::value const* value)
{
    if (value && value->is_int64())
        return value->get_int64();
    return std::nullopt;
}

std::optional<std::size_t> read_seats(json::value const* value)
{
    auto const seats = read_integer(value);
    if (!seats || *seats < 1 || *seats > static_cast<std::int64_t>(class_limits::seats))
        return std::nullopt;
    return static_cast<std::size_t>(*seats);
}

/// Pages may count fractions of milliseconds.
std::optional<std::int64_t> read_milliseconds(json::value const* value)
{
    constexpr std::int64_t max = std::int64_t{1} << 53; // what numbers of JavaScript hold
    if (!value)
        return 0;
    std::optional<std::int64_t> time;
    if (value->is_int64())
        time = value->get_int64();
    else if (value->is_double() && value->get_double() >= 0 &&
             value->get_double() <= static_cast<double>(max))
        time = static_cast<std::int64_t>(value->get_double());
    return time && *time >= 0 && *time <= max ? time : std::nullopt;
}

/// What isn't as it should be is left out.
std::optional<StudentProgram> read_student_program(json::value const* value)
{
    auto const* program = value ? value->if_object() : nullptr;
    auto const* file = program ? string_in(*program, "file") : nullptr;
    if (!file || !is_editable_name(*file))
        return std::nullopt;
    StudentProgram read;
    read.file = *file;
    auto const* changed = program->if_contains("changed");
    read.is_changed = changed && changed->is_bool() && changed->get_bool();
    if (auto const line = read_integer(program->if_contains("line")))
        read.wrong_line = *line > 0 && *line <= class_limits::line ? *line : 0;
    if (auto const* goal = program->if_contains("goal"))
        read.goal = read_milliseconds(goal);
    return read;
}

bool is_world(std::string_view world, std::string_view mode)
{
    return is_world_address(world) && (mode == "mjpeg" || mode == "w3d" || mode == "x3d");
}

ClassMessage read_world(json::object const& change)
{
    auto const* world = string_in(change, "world");
    auto const* mode = string_in(change, "mode");
    if (!world || !mode)
        return BadClassMessage();
    if (!is_world(*world, *mode))
        return BadClassMessage{ClassError::world};
    return ChangeWorld{std::string(*world), std::string(*mode)};
}

ClassMessage read_teach(json::object const& teach)
{
    if (auto const* key = string_in(teach, "key"))
        return ReturnAsTeacher{std::string(*key)};
    auto const* password = string_in(teach, "password");
    auto const* world = string_in(teach, "world");
    auto const* mode = string_in(teach, "mode");
    if (!password || !world || !mode)
        return BadClassMessage();
    if (!is_world(*world, *mode))
        return BadClassMessage{ClassError::world};
    auto const seats = read_seats(teach.if_contains("seats"));
    if (!seats)
        return BadClassMessage{ClassError::seats};
    return OpenClass{std::string(*password), std::string(*world), std::string(*mode), *seats};
}

ClassMessage read_join(json::object const& join)
{
    if (auto const* token = string_in(join, "token"))
        return ReturnAsStudent{std::string(*token)};
    auto const* code = string_in(join, "code");
    auto const* name = string_in(join, "name");
    if (!code || !name)
        return BadClassMessage();
    auto line = line_of_person(*name, class_limits::name);
    if (!line)
        return BadClassMessage{ClassError::name};
    return JoinClass{read_class_code(*code), std::move(*line)};
}

ClassMessage read_state(json::object const& report)
{
    auto const* state = find_value(states, string_in(report, "state"));
    auto const time = read_milliseconds(report.if_contains("time"));
    if (!state || *state == StudentState::away || !time)
        return BadClassMessage();
    ReportState message;
    message.state = *state;
    message.time = *time;
    if (auto const* simulator = string_in(report, "simulator"))
        message.simulator = *simulator;
    if (auto const* why = string_in(report, "why"))
        message.why = line_of_person(*why, class_limits::text).value_or(std::string());
    message.ahead = read_integer(report.if_contains("ahead"));
    if (message.ahead && (*message.ahead < 0 || *message.ahead > class_limits::ahead))
        message.ahead.reset();
    message.program = read_student_program(report.if_contains("program"));
    return message;
}

bool is_program(json::string const* file, json::string const* text)
{
    return file && text && is_editable_name(*file) && text->size() <= largest_editable &&
           is_editable_text(*text);
}

ClassMessage read_program(json::object const& program)
{
    auto const* file = string_in(program, "file");
    auto const* text = string_in(program, "text");
    if (!is_program(file, text))
        return BadClassMessage();
    return ReportProgram{std::string(*file), std::string(*text)};
}

ClassMessage read_tell(json::object const& tell)
{
    auto const* action = find_value(actions, string_in(tell, "do"));
    auto const* students = tell.if_contains("students");
    if (!action || !students || (!students->is_null() && !students->is_array()))
        return BadClassMessage();
    TellStudents message;
    message.action = *action;
    if (auto const* list = students->if_array()) {
        message.students.emplace();
        for (auto const& each : *list) {
            auto const id = read_integer(&each);
            if (!id || message.students->size() == class_limits::seats * class_limits::students_per_seat)
                return BadClassMessage();
            message.students->push_back(*id);
        }
    }
    if (message.action == ClassAction::message) {
        auto const* text = string_in(tell, "text");
        auto line = text ? line_of_person(*text, class_limits::text) : std::nullopt;
        if (!line)
            return BadClassMessage();
        message.text = std::move(*line);
    }
    if (message.action == ClassAction::take) {
        auto const* file = string_in(tell, "file");
        auto const* text = string_in(tell, "text");
        if (!is_program(file, text))
            return BadClassMessage();
        message.file = *file;
        message.text = *text;
    }
    return message;
}

ClassMessage read_value(std::string_view key, json::value const& value)
{
    if (auto const* object = value.if_object()) {
        if (key == "teach")
            return read_teach(*object);
        if (key == "join")
            return read_join(*object);
        if (key == "world")
            return read_world(*object);
        if (key == "state")
            return read_state(*object);
        if (key == "tell")
            return read_tell(*object);
        if (key == "program")
            return read_program(*object);
    }
    if (auto const* text = value.if_string()) {
        if (key == "picture")
            return ReportPicture{std::string(*text)};
        if (key == "code" && *text == "new")
            return RenewCode();
        if (key == "check")
            return CheckCode{read_class_code(*text)};
        if (auto const* sign = key == "sign" ? find_value(signs, text) : nullptr)
            return ShowSign{*sign};
    }
    if (auto const* on = value.if_bool()) {
        if (key == "watch")
            return WatchPictures{*on};
        if (key == "close" && *on)
            return CloseClass();
        if (key == "leave" && *on)
            return LeaveClass();
    }
    if (key == "seats") {
        auto const seats = read_seats(&value);
        return seats ? ClassMessage(SetSeats{*seats}) : BadClassMessage{ClassError::seats};
    }
    return BadClassMessage();
}

json::value value_of(StudentProgram const& program)
{
    json::object object{{"file", program.file}, {"changed", program.is_changed}};
    if (program.wrong_line > 0)
        object["line"] = program.wrong_line;
    if (program.goal)
        object["goal"] = *program.goal;
    return object;
}

json::value value_of(StudentRow const& student)
{
    json::object object;
    object["id"] = student.id;
    object["name"] = student.name;
    object["state"] = name_of(states, student.state);
    object["time"] = student.time;
    if (!student.simulator.empty())
        object["simulator"] = student.simulator;
    if (student.sign != StudentSign::none)
        object["sign"] = name_of(signs, student.sign);
    if (!student.why.empty())
        object["why"] = student.why;
    if (student.ahead)
        object["ahead"] = *student.ahead;
    if (student.program)
        object["program"] = value_of(*student.program);
    return object;
}

json::array array_of(std::vector<std::string> const& texts)
{
    json::array array;
    for (auto const& text : texts)
        array.emplace_back(text);
    return array;
}

json::value value_of(StagedSeats const& staged)
{
    return {{"ready", staged.ready}, {"seats", staged.seats}};
}

/// An object with this member alone.
std::string message_with(std::string_view key, json::value value)
{
    json::object object;
    object[key] = std::move(value);
    return json::serialize(object);
}

struct ErrorText
{
    std::string_view code;
    std::string_view text;
};

ErrorText text_of(ClassError error)
{
    switch (error) {
    case ClassError::off:
        return {"off", "This server has no classes. Its operator can set \"teacherPassword\"."};
    case ClassError::password:
        return {"password", "This is not the teachers' password of this server."};
    case ClassError::tries:
        return {"tries", "Too many wrong passwords or codes were tried, or too many have joined. Wait a "
                         "minute, then try again."};
    case ClassError::code:
        return {"code", "There is no such class. Check the code, or ask your teacher for a new one."};
    case ClassError::full:
        return {"full", "This class is full. Ask your teacher for more seats."};
    case ClassError::name:
        return {"name", "Please enter a name of 1 to 40 letters."};
    case ClassError::limit:
        return {"limit", "This server has too many classes, or windows of this class. Close one first."};
    case ClassError::seats:
        return {"seats", "A class has 1 to 100 seats."};
    case ClassError::world:
        return {"world",
                "A class needs the address of a world, which ends in .wbt, and a mode: mjpeg, w3d or "
                "x3d."};
    case ClassError::message:
        break;
    }
    return {"message", "The server did not understand this page. Reload it, and try again."};
}

} // namespace

ClassMessage parse_class_message(std::string_view text)
{
    if (text.size() > class_limits::message)
        return BadClassMessage();
    boost::system::error_code failed;
    auto const value = json::parse({text.data(), text.size()}, failed);
    auto const* object = failed ? nullptr : value.if_object();
    if (!object || object->size() != 1)
        return BadClassMessage();
    auto const& member = *object->begin();
    return read_value(member.key(), member.value());
}

std::string class_error_message(ClassError error)
{
    auto const [code, text] = text_of(error);
    json::object object;
    object["error"] = code;
    object["text"] = text;
    return json::serialize(object);
}

std::string class_closed_message(ClassEnd end)
{
    switch (end) {
    case ClassEnd::teacher:
        return message_with("closed", "teacher");
    case ClassEnd::idle:
        return message_with("closed", "idle");
    case ClassEnd::removed:
        return message_with("closed", "removed");
    case ClassEnd::server:
        break;
    }
    return message_with("closed", "server");
}

std::string class_message(ClassRow const& row)
{
    json::array students;
    for (auto const& student : row.students)
        students.push_back(value_of(student));
    json::object object;
    object["code"] = row.code;
    object["key"] = row.key;
    object["world"] = row.world;
    object["mode"] = row.mode;
    object["seats"] = row.seats;
    object["reserved"] = row.reserved;
    if (row.staged)
        object["staged"] = value_of(*row.staged);
    object["students"] = std::move(students);
    object["machines"] = array_of(row.machines);
    if (!row.network.addresses.empty())
        object["network"] = {{"addresses", array_of(row.network.addresses)}, {"open", row.network.is_open}};
    return message_with("class", std::move(object));
}

std::string student_message(StudentRow const& student)
{
    return message_with("student", value_of(student));
}

std::string gone_message(StudentId student)
{
    return message_with("gone", student);
}

std::string picture_message(StudentId student, std::string_view base64)
{
    json::object picture;
    picture["id"] = student;
    picture["jpeg"] = base64;
    return message_with("picture", std::move(picture));
}

std::string program_message(StudentId student, std::string_view file, std::string_view text)
{
    return message_with("program", {{"id", student}, {"file", file}, {"text", text}});
}

std::string reserved_message(std::size_t seats)
{
    return message_with("reserved", seats);
}

std::string staged_seats_message(std::optional<StagedSeats> const& staged)
{
    return message_with("staged", staged ? value_of(*staged) : json::value());
}

std::string code_message(std::string_view code)
{
    return message_with("code", json::string(code));
}

std::string world_message(std::string_view world, std::string_view mode)
{
    return message_with("world", {{"world", world}, {"mode", mode}});
}

std::string checked_message(std::string_view code)
{
    return message_with("checked", json::string(code));
}

std::string sign_message(StudentSign sign)
{
    return message_with("sign", json::string(name_of(signs, sign)));
}

std::string joined_message(JoinedRow const& row)
{
    json::object joined;
    joined["id"] = row.id;
    joined["token"] = row.token;
    joined["seat"] = row.seat;
    joined["name"] = row.name;
    joined["world"] = row.world;
    joined["mode"] = row.mode;
    if (row.sign != StudentSign::none)
        joined["sign"] = name_of(signs, row.sign);
    return message_with("joined", std::move(joined));
}

std::string pictures_message(PictureTerms const* terms)
{
    if (!terms)
        return message_with("pictures", nullptr);
    json::object object;
    object["interval"] = terms->interval.count();
    object["width"] = terms->width;
    object["height"] = terms->height;
    object["bytes"] = terms->bytes;
    return message_with("pictures", std::move(object));
}

std::string action_message(TellStudents const& message)
{
    json::object object;
    object["do"] = name_of(actions, message.action);
    if (!message.file.empty())
        object["file"] = message.file;
    if (!message.text.empty() || message.action == ClassAction::take)
        object["text"] = message.text;
    return json::serialize(object);
}

} // namespace webots_cloud::core
