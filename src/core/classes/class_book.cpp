// The classes as plain data with rules: every message of a teacher or student changes the book, and `obey`
// returns what is to be said to whom. Nothing waits here; class_endpoint.cpp has the sockets, and calls
// `expire` as time passes.
#include "class_book.hpp"

#include "core/text.hpp"

#include <algorithm>

namespace webots_cloud::core {
namespace {

// Close codes of WebSockets (RFC 6455, 7.4.1).
constexpr std::uint16_t normal = 1000;
constexpr std::uint16_t policy_violation = 1008;
constexpr std::uint16_t try_again_later = 1013;
constexpr std::uint16_t taken_over = 4001; // ours, as on /client: another window has the student

} // namespace

struct ClassBook::Student
{
    StudentId id = 0;
    std::string name;
    std::string token;
    std::string seat_token;
    StudentState state = StudentState::joined;
    std::int64_t time = 0;
    std::string simulator; ///< As `simulator_entry` has it; empty: none.
    std::string why;       ///< As its page says.
    std::optional<std::int64_t> ahead;
    std::optional<StudentProgram> program;
    StudentSign sign = StudentSign::none;
    StudentMachine machine;         ///< That the class gave.
    bool has_seat = false;          ///< One that was held.
    bool program_wanted = false;    ///< A teacher has asked for it.
    ClassConnection connection = 0; ///< 0: it is lost.
    TimePoint lost_at{};
    Pace states;
    Pace signs;
    Pace pictures;
    Pace seats;
    Pace held_seats;

    StudentRow row() const
    {
        StudentRow row;
        row.id = id;
        row.name = name;
        row.state = connection == 0 ? StudentState::away : state;
        row.time = time;
        row.sign = sign;
        if (connection != 0) {
            row.why = why;
            row.ahead = ahead;
            row.program = program ? &*program : nullptr;
        }
        return row;
    }
};

struct ClassBook::Class
{
    /// A window of the teacher.
    struct Window
    {
        ClassConnection connection = 0;
        bool watches = false; ///< Wants pictures.
    };

    std::size_t seats_wanted() const noexcept { return seats - std::min(seats, seated); }

    bool is_watched() const
    {
        return std::any_of(windows.begin(), windows.end(),
                           [](Window const& window) { return window.watches; });
    }

    std::size_t present() const
    {
        return static_cast<std::size_t>(std::count_if(
            students.begin(), students.end(), [](auto const& each) { return each.second.connection != 0; }));
    }

    std::string code;
    std::string key;
    std::string world;
    std::string mode;
    std::size_t seats = 0;
    std::size_t seated = 0;            ///< Students who have one.
    std::size_t reserved = 0;          ///< As the teacher was told.
    std::optional<StagedSeats> staged; ///< Likewise.
    std::map<StudentId, Student> students;
    StudentId last_id = 0;
    std::vector<Window> windows;
    TimePoint left_at{};               ///< Since when there is no window.
    std::optional<PictureTerms> terms; ///< As students were told; none: they send no pictures.
};

ClassBook::ClassBook(ClassHooks hooks) : hooks_(std::move(hooks)) {}

ClassBook::~ClassBook() = default;

void ClassBook::connect(ClassConnection connection, std::string quota_key)
{
    auto const evicted = silent_.enter(connection, quota_key);
    connections_[connection].quota_key = std::move(quota_key);
    if (evicted)
        close(*evicted, class_error_message(ClassError::limit), try_again_later);
}

void ClassBook::take(ClassConnection connection, std::string_view text, TimePoint now)
{
    auto const found = connections_.find(connection);
    if (found == connections_.end() || found->second.closing)
        return;
    if (!found->second.messages.take(now, class_limits::message_interval, class_limits::message_burst))
        return close(connection, {}, policy_violation);
    auto const message = parse_class_message(text);
    std::visit([&](auto const& each) { obey(connection, each, now); }, message);
}

void ClassBook::disconnect(ClassConnection connection, TimePoint now)
{
    silent_.leave(connection);
    auto const found = connections_.find(connection);
    if (found == connections_.end())
        return;
    auto* const of = found->second.of;
    auto const id = found->second.student;
    connections_.erase(found);
    if (!of)
        return;
    if (id == 0) {
        std::erase_if(of->windows,
                      [connection](auto const& window) { return window.connection == connection; });
        if (of->windows.empty())
            of->left_at = now;
    } else if (auto const student = of->students.find(id);
               student != of->students.end() && student->second.connection == connection) {
        student->second.connection = 0;
        student->second.lost_at = now;
        tell_teachers(*of, student->second);
    }
    update_pictures(*of);
}

void ClassBook::expire(TimePoint now)
{
    std::vector<Class*> idle;
    for (auto const& each : classes_) {
        if (each->windows.empty() && now - each->left_at >= class_limits::keep_class)
            idle.push_back(each.get());
        std::vector<StudentId> gone;
        for (auto const& [id, student] : each->students)
            if (student.connection == 0 && now - student.lost_at >= class_limits::keep_student)
                gone.push_back(id);
        for (auto const id : gone)
            forget_student(*each, id);
    }
    for (auto* const each : idle)
        end_class(*each, ClassEnd::idle);
    share_free_seats();
}

void ClassBook::stop()
{
    for (auto const& [id, connection] : connections_)
        if (connection.of && !connection.closing)
            say(id, class_closed_message(ClassEnd::server));
}

SeatRequest ClassBook::ask_for_seat(std::string_view seat_token, TimePoint now)
{
    auto const [of, student] = find_student(seat_tokens_, seat_token);
    if (!student)
        return SeatRequest::unknown;
    if (!student->seats.has_token(now, class_limits::seat_interval, class_limits::seat_burst))
        return SeatRequest::too_often;
    release_seat(*of, *student);
    bool const may_have_held =
        student->held_seats.has_token(now, class_limits::held_seat_interval, class_limits::held_seat_burst);
    return may_have_held && of->seats_wanted() > 0 ? SeatRequest::held : SeatRequest::any;
}

std::string ClassBook::class_of(std::string_view seat_token) const
{
    auto const [of, student] = find_student(seat_tokens_, seat_token);
    return student ? of->code : std::string();
}

void ClassBook::take_seat(std::string_view seat_token, SeatRequest seat, StudentMachine machine,
                          TimePoint now)
{
    auto const [of, student] = find_student(seat_tokens_, seat_token);
    if (!student)
        return;
    (void)student->seats.take(now, class_limits::seat_interval, class_limits::seat_burst);
    student->machine = std::move(machine);
    student->simulator.clear();
    if (seat == SeatRequest::held && !student->has_seat) {
        (void)student->held_seats.take(now, class_limits::held_seat_interval, class_limits::held_seat_burst);
        student->has_seat = true;
        ++of->seated;
    }
}

std::size_t ClassBook::seats_to_hold() const noexcept
{
    std::size_t seats = 0;
    for (auto const& each : classes_)
        seats += each->seats_wanted();
    return seats;
}

std::vector<StagingWish> ClassBook::staging_wishes() const
{
    std::vector<StagingWish> wishes;
    for (auto const& each : classes_) {
        auto& wish = wishes.emplace_back();
        wish.url = each->world;
        wish.mode = each->mode;
        wish.count = static_cast<int>(each->seats_wanted());
    }
    return wishes;
}

void ClassBook::note_ready(std::vector<int> const& ready)
{
    for (std::size_t i = 0; i < classes_.size(); ++i) {
        auto& of = *classes_[i];
        std::optional<StagedSeats> staged;
        if (i < ready.size() && of.seats_wanted() > 0)
            staged = StagedSeats{static_cast<std::size_t>(ready[i]), of.seats_wanted()};
        if (std::exchange(of.staged, staged) != staged)
            tell_teachers(of, staged_seats_message(staged));
    }
}

ClassFigures ClassBook::figures() const noexcept
{
    ClassFigures figures;
    figures.classes = classes_.size();
    figures.students = tokens_.size();
    figures.seats_held = seats_to_hold();
    return figures;
}

void ClassBook::obey(ClassConnection from, BadClassMessage const& message, TimePoint)
{
    refuse(from, message.error);
}

void ClassBook::obey(ClassConnection from, OpenClass const& message, TimePoint now)
{
    auto const& quota_key = connections_.at(from).quota_key;
    if (connections_.at(from).of)
        return refuse(from, ClassError::message);
    if (password_.empty())
        return refuse(from, ClassError::off);
    if (!may_try(passwords_, from, "passwords of teachers", now))
        return;
    if (!equal_in_constant_time(message.password, password_)) {
        passwords_.count_wrong(quota_key, now);
        return refuse(from, ClassError::password);
    }
    if (classes_.size() >= class_limits::classes)
        return refuse(from, ClassError::limit);
    auto made = std::make_unique<Class>();
    made->code = unused_code();
    made->key = make_class_token(hooks_.random);
    made->world = message.world;
    made->mode = message.mode;
    made->seats = message.seats;
    auto& added = *classes_.emplace_back(std::move(made));
    share_free_seats();
    add_teacher(added, from);
}

void ClassBook::obey(ClassConnection from, ReturnAsTeacher const& message, TimePoint)
{
    if (connections_.at(from).of)
        return refuse(from, ClassError::message);
    auto const found = std::find_if(classes_.begin(), classes_.end(), [&message](auto const& each) {
        return equal_in_constant_time(each->key, message.key);
    });
    if (found == classes_.end())
        return refuse(from, ClassError::code);
    if ((*found)->windows.size() >= class_limits::windows)
        return refuse(from, ClassError::limit);
    add_teacher(**found, from);
}

void ClassBook::obey(ClassConnection from, SetSeats const& message, TimePoint)
{
    auto* const of = class_of_teacher(from);
    if (!of)
        return;
    of->seats = message.seats;
    share_free_seats();
}

/// What was the task is not any more, and everybody may start, whoever has started often.
void ClassBook::obey(ClassConnection from, ChangeWorld const& message, TimePoint)
{
    auto* const of = class_of_teacher(from);
    if (!of)
        return;
    of->world = message.world;
    of->mode = message.mode;
    auto const text = world_message(of->world, of->mode);
    tell_teachers(*of, text);
    for (auto& [id, student] : of->students) {
        student.held_seats = Pace();
        lower(*of, student);
        if (student.connection != 0)
            say(student.connection, text);
    }
}

void ClassBook::obey(ClassConnection from, WatchPictures const& message, TimePoint)
{
    auto* const of = class_of_teacher(from);
    if (!of)
        return;
    for (auto& window : of->windows)
        if (window.connection == from)
            window.watches = message.on;
    update_pictures(*of);
}

void ClassBook::obey(ClassConnection from, TellStudents const& message, TimePoint)
{
    auto* const of = class_of_teacher(from);
    if (!of)
        return;
    std::vector<StudentId> students;
    if (message.students)
        students = *message.students;
    else
        for (auto const& [id, student] : of->students)
            students.push_back(id);
    auto const text = action_message(message);
    for (auto const id : students) {
        auto const found = of->students.find(id);
        if (found == of->students.end())
            continue;
        auto const connection = found->second.connection;
        if (message.action == ClassAction::remove) {
            forget_student(*of, id);
            if (connection != 0)
                close(connection, class_closed_message(ClassEnd::removed), normal);
        } else if (message.action == ClassAction::lower) {
            lower(*of, found->second);
        } else if (connection != 0) {
            // Whoever has had many seats already may have this one: the teacher wants it.
            if (message.action == ClassAction::start)
                found->second.held_seats = Pace();
            found->second.program_wanted |= message.action == ClassAction::program;
            say(connection, text);
        }
    }
    if (message.action == ClassAction::remove)
        update_pictures(*of);
}

void ClassBook::obey(ClassConnection from, RenewCode const&, TimePoint)
{
    auto* const of = class_of_teacher(from);
    if (!of)
        return;
    of->code = unused_code();
    tell_teachers(*of, code_message(of->code));
}

void ClassBook::obey(ClassConnection from, CloseClass const&, TimePoint)
{
    if (auto* const of = class_of_teacher(from))
        end_class(*of, ClassEnd::teacher);
}

void ClassBook::obey(ClassConnection from, CheckCode const& message, TimePoint now)
{
    if (auto const* const of = class_to_join(from, message.code, now))
        say(from, checked_message(of->code));
}

void ClassBook::obey(ClassConnection from, JoinClass const& message, TimePoint now)
{
    auto* const found = class_to_join(from, message.code, now);
    if (!found)
        return;
    auto& of = *found;
    if (joins_.take(connections_.at(from).quota_key, now) != TokenBuckets::Verdict::taken)
        return refuse(from, ClassError::tries);
    auto const id = ++of.last_id;
    auto& student = of.students[id];
    student.id = id;
    student.name = message.name;
    student.token = make_class_token(hooks_.random);
    student.seat_token = make_class_token(hooks_.random);
    tokens_.emplace(student.token, std::pair(&of, id));
    seat_tokens_.emplace(student.seat_token, std::pair(&of, id));
    greet_student(of, student, from);
}

void ClassBook::obey(ClassConnection from, ReturnAsStudent const& message, TimePoint)
{
    if (connections_.at(from).of)
        return refuse(from, ClassError::message);
    auto const [of, student] = find_student(tokens_, message.token);
    if (!student)
        return refuse(from, ClassError::code);
    auto const old = student->connection;
    greet_student(*of, *student, from);
    if (old != 0)
        close(old, {}, taken_over);
}

void ClassBook::obey(ClassConnection from, ReportState const& message, TimePoint now)
{
    // Of some that come at once the last one counts, so a few may.
    constexpr int burst = 3;
    auto const [of, student] = class_of_student(from);
    if (!student || !student->states.take(now, class_limits::state_interval, burst))
        return;
    student->state = message.state;
    student->time = message.time;
    student->why = message.why;
    student->ahead = message.ahead;
    student->program = message.program;
    bool const is_short = message.simulator.size() <= class_limits::simulator;
    student->simulator = is_short ? simulator_entry(message.simulator, student->machine) : std::string();
    if (message.state == StudentState::ended)
        release_seat(*of, *student);
    tell_teachers(*of, *student);
}

/// The page shows what it is told in answer, also where nothing has changed.
void ClassBook::obey(ClassConnection from, ShowSign const& message, TimePoint now)
{
    auto const [of, student] = class_of_student(from);
    if (!student)
        return;
    if (student->signs.take(now, class_limits::sign_interval, class_limits::sign_burst) &&
        std::exchange(student->sign, message.sign) != message.sign)
        tell_teachers(*of, *student);
    say(from, sign_message(student->sign));
}

void ClassBook::obey(ClassConnection from, ReportPicture const& message, TimePoint now)
{
    constexpr int burst = 2; // networks are not even
    auto const [of, student] = class_of_student(from);
    if (!student || !of->terms || !is_picture_in_base64(message.base64, *of->terms) ||
        !student->pictures.take(now, of->terms->interval, burst))
        return;
    auto const text = picture_message(student->id, message.base64);
    for (auto const& window : of->windows)
        if (window.watches) {
            say(window.connection, text);
            output_.back().is_picture = true;
        }
}

/// Once for each question, so that a page can't fill the teacher's.
void ClassBook::obey(ClassConnection from, ReportProgram const& message, TimePoint)
{
    auto const [of, student] = class_of_student(from);
    if (student && std::exchange(student->program_wanted, false))
        tell_teachers(*of, program_message(student->id, message.file, message.text));
}

void ClassBook::obey(ClassConnection from, LeaveClass const&, TimePoint)
{
    auto const [of, student] = class_of_student(from);
    if (!student)
        return;
    forget_student(*of, student->id);
    close(from, {}, normal);
    update_pictures(*of);
}

/// Null: it is no teacher's, and was told so.
ClassBook::Class* ClassBook::class_of_teacher(ClassConnection from)
{
    auto const& connection = connections_.at(from);
    if (connection.of && connection.student == 0)
        return connection.of;
    refuse(from, ClassError::message);
    return nullptr;
}

/// Null: nobody can come in, and that was said.
ClassBook::Class* ClassBook::class_to_join(ClassConnection from, std::string_view code, TimePoint now)
{
    auto const& connection = connections_.at(from);
    if (connection.of) {
        refuse(from, ClassError::message);
        return nullptr;
    }
    if (!may_try(codes_, from, "codes of classes", now))
        return nullptr;
    auto const found = std::find_if(classes_.begin(), classes_.end(),
                                    [code](auto const& each) { return each->code == code; });
    if (found == classes_.end()) {
        codes_.count_wrong(connection.quota_key, now);
        refuse(from, ClassError::code);
        return nullptr;
    }
    if ((*found)->students.size() >= class_limits::students_per_seat * (*found)->seats) {
        refuse(from, ClassError::full);
        return nullptr;
    }
    return found->get();
}

/// Null: it is no student's, and was told so.
std::pair<ClassBook::Class*, ClassBook::Student*> ClassBook::class_of_student(ClassConnection from)
{
    auto const& connection = connections_.at(from);
    if (connection.of && connection.student != 0)
        return {connection.of, &connection.of->students.at(connection.student)};
    refuse(from, ClassError::message);
    return {nullptr, nullptr};
}

std::pair<ClassBook::Class*, ClassBook::Student*> ClassBook::find_student(Tokens const& tokens,
                                                                          std::string_view token)
{
    auto const found = tokens.find(std::string(token));
    if (found == tokens.end())
        return {nullptr, nullptr};
    auto const [of, id] = found->second;
    return {of, &of->students.at(id)};
}

std::string ClassBook::unused_code() const
{
    for (;;) {
        auto code = make_class_code(hooks_.random);
        if (std::none_of(classes_.begin(), classes_.end(),
                         [&code](auto const& each) { return each->code == code; }))
            return code;
    }
}

bool ClassBook::may_try(GuessLimit const& limit, ClassConnection from, std::string_view what, TimePoint now)
{
    auto const& quota_key = connections_.at(from).quota_key;
    if (limit.may_try(quota_key, now))
        return true;
    refuse(from, ClassError::tries);
    hooks_.tell_of_guesses(what, quota_key);
    return false;
}

/// To a window that is new, the whole class is told.
void ClassBook::add_teacher(Class& of, ClassConnection teacher)
{
    silent_.leave(teacher);
    connections_.at(teacher).of = &of;
    of.windows.emplace_back().connection = teacher;
    ClassRow row;
    row.code = of.code;
    row.key = of.key;
    row.world = of.world;
    row.mode = of.mode;
    row.seats = of.seats;
    row.reserved = of.reserved;
    row.staged = of.staged;
    std::vector<std::string> simulators; // which the rows refer to
    simulators.reserve(of.students.size());
    for (auto const& [id, student] : of.students) {
        row.students.push_back(student.row());
        row.students.back().simulator = simulators.emplace_back(simulator_for(teacher, student.simulator));
    }
    row.machines = hooks_.machines(teacher);
    if (row.machines.size() > class_limits::machines)
        row.machines.resize(class_limits::machines);
    if (hooks_.network)
        row.network = hooks_.network(teacher);
    if (row.network.addresses.size() > class_limits::addresses)
        row.network.addresses.resize(class_limits::addresses);
    say(teacher, class_message(row));
}

/// Of a student who joins or returns.
void ClassBook::greet_student(Class& of, Student& student, ClassConnection connection)
{
    silent_.leave(connection);
    connections_.at(connection).of = &of;
    connections_.at(connection).student = student.id;
    student.connection = connection;
    JoinedRow row;
    row.id = student.id;
    row.token = student.token;
    row.seat = student.seat_token;
    row.name = student.name;
    row.world = of.world;
    row.mode = of.mode;
    row.sign = student.sign;
    say(connection, joined_message(row));
    auto const before = of.terms;
    update_pictures(of);
    if (of.terms == before)
        say(connection, pictures_message(of.terms ? &*of.terms : nullptr));
    tell_teachers(of, student);
}

/// Its connection, if it has one, stays, and is in no class.
void ClassBook::forget_student(Class& of, StudentId id)
{
    auto const found = of.students.find(id);
    if (auto const connection = connections_.find(found->second.connection);
        connection != connections_.end()) {
        connection->second.of = nullptr;
        connection->second.student = 0;
    }
    release_seat(of, found->second);
    forget_tokens(found->second);
    of.students.erase(found);
    tell_teachers(of, gone_message(id));
}

void ClassBook::forget_tokens(Student const& student)
{
    tokens_.erase(student.token);
    seat_tokens_.erase(student.seat_token);
}

void ClassBook::end_class(Class& of, ClassEnd why)
{
    auto const text = class_closed_message(why);
    std::vector<ClassConnection> ended;
    for (auto const& [id, connection] : connections_)
        if (connection.of == &of)
            ended.push_back(id);
    for (auto const id : ended) {
        auto& connection = connections_.at(id);
        connection.of = nullptr;
        connection.student = 0;
        close(id, text, normal);
    }
    for (auto const& [id, student] : of.students)
        forget_tokens(student);
    std::erase_if(classes_, [&of](auto const& each) { return each.get() == &of; });
    share_free_seats();
}

/// Classes that were opened first come first. What they have already counts as reserved, too.
void ClassBook::share_free_seats()
{
    if (classes_.empty())
        return;
    auto free = hooks_.free_seats();
    for (auto const& each : classes_) {
        auto const share = std::min(free, each->seats_wanted());
        free -= share;
        auto const reserved = std::min(each->seats, each->seated + share);
        if (std::exchange(each->reserved, reserved) != reserved)
            tell_teachers(*each, reserved_message(reserved));
    }
}

/// Tells the students which pictures are wanted, if that has changed.
void ClassBook::update_pictures(Class& of)
{
    std::optional<PictureTerms> terms;
    if (of.is_watched())
        terms = picture_terms(of.present());
    if (std::exchange(of.terms, terms) == terms)
        return;
    auto const text = pictures_message(terms ? &*terms : nullptr);
    for (auto const& [id, student] : of.students)
        if (student.connection != 0)
            say(student.connection, text);
}

void ClassBook::lower(Class& of, Student& student)
{
    if (std::exchange(student.sign, StudentSign::none) == StudentSign::none)
        return;
    tell_teachers(of, student);
    if (student.connection != 0)
        say(student.connection, sign_message(StudentSign::none));
}

void ClassBook::release_seat(Class& of, Student& student)
{
    if (std::exchange(student.has_seat, false))
        --of.seated;
}

void ClassBook::tell_teachers(Class const& of, std::string const& text)
{
    for (auto const& window : of.windows)
        say(window.connection, text);
}

void ClassBook::tell_teachers(Class const& of, Student const& student)
{
    auto row = student.row();
    for (auto const& window : of.windows) {
        auto const simulator = simulator_for(window.connection, student.simulator);
        row.simulator = simulator;
        say(window.connection, student_message(row));
    }
}

/// As this browser reaches it.
std::string ClassBook::simulator_for(ClassConnection teacher, std::string_view entry)
{
    return entry.empty() ? std::string() : hooks_.simulator_address(entry, teacher);
}

void ClassBook::say(ClassConnection to, std::string text)
{
    ClassOutput output;
    output.to = to;
    output.text = std::move(text);
    output_.push_back(std::move(output));
}

void ClassBook::close(ClassConnection connection, std::string text, std::uint16_t code)
{
    say(connection, std::move(text));
    output_.back().close_code = code;
    if (auto const found = connections_.find(connection); found != connections_.end())
        found->second.closing = true;
}

} // namespace webots_cloud::core
