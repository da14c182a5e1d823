// webots-site: starts and stops the servers of a checkout, for server.sh.

#include "site/site.hpp"

int main(int argc, char** argv)
{
    return webots_cloud::site::run({argv + 1, argv + argc});
}
