// A module of Python that schedules: the static library goes into a shared object.
#include <webots_cloud/scheduler.hpp>

#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

namespace {

using namespace webots_cloud;

class PythonScheduler
{
public:
    void set_servers(std::vector<std::string> const& addresses)
    {
        std::vector<ServerSpec> servers;
        for (auto const& address : addresses)
            servers.emplace_back(address);
        scheduler_.set_servers(std::move(servers));
    }

    void report(std::string const& address, double percent)
    {
        scheduler_.report(address, LoadReport(percent), now());
    }

    std::string place()
    {
        auto const placement = scheduler_.place(now());
        if (!placement)
            throw std::runtime_error(placement.error().message());
        return std::string(placement->address);
    }

private:
    static TimePoint now() { return std::chrono::steady_clock::now(); }

    Scheduler scheduler_;
};

} // namespace

PYBIND11_MODULE(webots_scheduler, module)
{
    pybind11::class_<PythonScheduler>(module, "Scheduler")
        .def(pybind11::init<>())
        .def("set_servers", &PythonScheduler::set_servers)
        .def("report", &PythonScheduler::report)
        .def("place", &PythonScheduler::place);
}
