// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/server/cluster/simulation.h"

#include <algorithm>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <random>
#include <set>
#include <tuple>
#include <utility>
#include <vector>

#include "server/cluster/holder.h"
#include "tests/server/cluster/simulated_database.h"

namespace shapedb::cluster::sim {

namespace {

constexpr std::size_t kPage = 40;
constexpr Time kAnswerTimeout = 400;
constexpr Time kPatience = 4'000;  // of a search, and of a holder that waits for a change
constexpr std::int64_t kShapes = 300;

/// What searches of one server see.
struct Shown : Content {
    Versions versions = Versions(kShapes + 1);
};
using ShownPtr = std::shared_ptr<const Shown>;

/// Takes the shapes of some shards out.
void clear(Versions& versions, const ShardSet& shards) {
    for (std::size_t id = 1; id < versions.size(); ++id) {
        if (shards[static_cast<std::size_t>(shardOf(static_cast<std::int64_t>(id)))]) versions[id] = 0;
    }
}

class Shapes : public ReplicaContent {
  public:
    void begin(std::int64_t generation) override {
        begun_ = std::make_shared<Shown>();
        begun_->generation = generation;
    }
    Result<void> put(std::vector<store::IndexRow> rows) override {
        Shown& begun = own();
        for (const store::IndexRow& row : rows)
            begun.versions[static_cast<std::size_t>(row.shapeId)] = row.signature.pointsVersion;
        return {};
    }
    void remove(const std::vector<std::int64_t>& shapeIds) override {
        Shown& begun = own();
        for (const std::int64_t id : shapeIds) begun.versions[static_cast<std::size_t>(id)] = 0;
    }
    void drop(const ShardSet& shards) override { clear(own().versions, shards); }
    Result<void> show(const ShardSet& complete, std::int64_t number) override {
        Shown& begun = own();
        begun.complete = complete;
        begun.number = number;
        shown_ = begun_;
        return {};
    }
    ShownPtr shown() const { return shown_; }

  private:
    /// Copied only if a search still reads it.
    Shown& own() {
        if (begun_.use_count() > (shown_ == begun_ ? 2 : 1)) begun_ = std::make_shared<Shown>(*begun_);
        return *begun_;
    }
    std::shared_ptr<Shown> begun_ = std::make_shared<Shown>();
    std::shared_ptr<Shown> shown_ = std::make_shared<Shown>();
};

struct Search;

struct Server {
    Server(std::string called, const Options& options, Database& database)
        : name(std::move(called)),
          keeper({name, options.replicas, std::chrono::milliseconds(options.term)}),
          replica(database, content, Database::kCollection, kPage) {}

    std::string name;
    bool alive = true;
    Time pausedUntil = 0;
    LeaseKeeper keeper;
    Shapes content;
    Replica replica;
    std::uint64_t beats = 0;  // sent; answers to all but the last are ignored
    Time caughtUp = -1'000'000;
    RoutesPtr routes;
    std::vector<std::shared_ptr<Search>> waiting;  // for routes
};

/// What a server found in its shards.
struct Answer {
    Coverage coverage;
    Versions versions;
    std::int64_t upper = 0;  // the last change when it was made
    Time madeAt = 0;
};

using AnswerPtr = std::shared_ptr<const Answer>;
using AskPtr = std::shared_ptr<const Ask>;

struct Search {
    std::string coordinator;
    std::int64_t atLeast = 0;
    Time started = 0;
    Time deadline = 0;
    std::optional<Gather> gather;
    std::map<std::uint64_t, AnswerPtr> answers;
    bool ended = false;
    bool waitsForRoutes = false;
};
using SearchPtr = std::shared_ptr<Search>;

class World {
  public:
    explicit World(const Options& options)
        : options_(options), random_(options.seed), database_(options.replicas, kShapes) {}

    Outcome run() {
        for (std::int64_t id = 1; id <= kShapes / 2; ++id) database_.put(id);
        for (int i = 0; i < options_.servers; ++i) startServer();
        every(40, 160, [this] { write(); });
        every(20, 120, [this] { search(); });
        if (options_.faults) every(500, 4'000, [this] { fault(); });
        while (!events_.empty() && database_.now < options_.length && outcome_.difference.empty()) {
            std::pop_heap(events_.begin(), events_.end());
            const Event event = std::move(events_.back());
            events_.pop_back();
            database_.now = event.at;
            event.what();
        }
        outcome_.changes = static_cast<std::uint64_t>(database_.number());
        outcome_.switches = static_cast<std::uint64_t>(database_.switches());
        return outcome_;
    }

  private:
    struct Event {
        Time at = 0;
        std::uint64_t order = 0;
        std::function<void()> what;
        bool operator<(const Event& other) const {
            return std::tie(other.at, other.order) < std::tie(at, order);
        }
    };

    Time between(Time least, Time most) {
        return least + static_cast<Time>(random_() % static_cast<std::uint64_t>(most - least + 1));
    }
    bool chance(int percent) { return static_cast<int>(random_() % 100) < percent; }
    Instant now() const { return Instant(database_.now); }
    void at(Time time, std::function<void()> what) {
        events_.push_back({time, ++order_, std::move(what)});
        std::push_heap(events_.begin(), events_.end());
    }
    void after(Time delay, std::function<void()> what) { at(database_.now + delay, std::move(what)); }
    void every(Time least, Time most, std::function<void()> what) {
        after(between(least, most), [this, least, most, what] {
            what();
            every(least, most, what);
        });
    }
    /// Something that a server does: not while it is stopped, and not when it is dead.
    void onServer(const std::string& name, Time delay, std::function<void(Server&)> what) {
        after(delay, [this, name, what = std::move(what)] {
            const auto found = servers_.find(name);
            if (found == servers_.end()) return;
            Server& server = *found->second;
            if (server.pausedUntil > database_.now) {
                onServer(name, server.pausedUntil - database_.now, what);
                return;
            }
            what(server);
        });
    }
    /// A message, which may be late or lost.
    void send(const std::string& from, const std::string& to, std::function<void()> what) {
        if (cut_.count({from, to}) > 0 || cut_.count({to, from}) > 0) return;
        if (options_.faults && chance(1)) return;
        const Time delay = options_.faults && chance(3) ? between(100, 1'500) : between(1, 12);
        after(delay, std::move(what));
    }

    // Servers ------------------------------------------------------------------------

    void startServer() {
        const std::string name = "server-" + std::to_string(++started_);
        servers_[name] = std::make_unique<Server>(name, options_, database_);
        beat(name);
        follow(name);
    }

    /// The loop of the keeper: three times in a lease.
    void beat(const std::string& name) {
        onServer(name, between(1, options_.term / 3), [this, name](Server& server) {
            server.replica.setWanted(server.keeper.wanted(now()));
            // A copy that no longer follows is not worth a lease.
            const bool follows = server.caughtUp + options_.term / 2 >= database_.now;
            server.keeper.setLoaded(follows ? server.replica.complete() : ShardSet());
            const Beat beatNow = server.keeper.next(now());
            const Instant sentAt = now();
            const std::uint64_t number = ++server.beats;
            send(name, "database", [this, name, beatNow, sentAt, number] {
                const auto answered = database_.beat(beatNow);
                if (!answered) return;
                const auto view = std::make_shared<const ClusterView>(*answered);
                send("database", name, [this, name, view, sentAt, number] {
                    onServer(name, 0, [view, sentAt, number](Server& me) {
                        if (me.beats != number) return;
                        me.keeper.onView(sentAt, *view);
                        me.routes = routesOf(*view);
                    });
                });
            });
            beat(name);
        });
    }

    void follow(const std::string& name) {
        onServer(name, between(2, 30), [this, name](Server& server) {
            const bool reachable = cut_.count({name, "database"}) == 0 && cut_.count({"database", name}) == 0;
            const auto more = reachable ? server.replica.step() : Result<bool>(true);
            if (reachable && more && !*more) server.caughtUp = database_.now;
            follow(name);
        });
    }

    /// What a holder does with an ask: waits for the change, takes what is shown, makes sure of its leases
    /// and answers.
    void onAsk(const std::string& name, const SearchPtr& search, const AskPtr& ask, Time givesUp) {
        onServer(name, between(0, 3), [this, name, search, ask, givesUp](Server& server) {
            const ShownPtr shown = server.content.shown();
            onServer(name, between(0, 3), [this, name, search, ask, givesUp, shown](Server& me) {
                switch (answerable(*ask, *shown, me.keeper, now())) {
                    case Answerable::kYes: return answer(name, search, ask, shown);
                    case Answerable::kNo: return refuse(name, search, ask);
                    case Answerable::kBehind: break;
                }
                if (database_.now >= givesUp) return refuse(name, search, ask);
                onServer(name, 20,
                         [this, name, search, ask, givesUp](Server&) { onAsk(name, search, ask, givesUp); });
            });
        });
    }

    void refuse(const std::string& name, const SearchPtr& search, const AskPtr& ask) {
        send(name, search->coordinator, [this, search, ask] { failed(search, ask->id); });
    }

    void answer(const std::string& name, const SearchPtr& search, const AskPtr& ask, const ShownPtr& shown) {
        const auto made = std::make_shared<Answer>();
        made->coverage = {ask->shards, shown->number, shown->generation};
        made->upper = database_.number();
        made->madeAt = database_.now;
        ShardSet others = ShardSet().set();
        for (const auto& [shard, epoch] : ask->shards) {
            others.reset(static_cast<std::size_t>(shard));
            if (!database_.holds(name, shard, epoch)) differ(name + " answers for a shard that it has lost");
        }
        made->versions = shown->versions;
        clear(made->versions, others);
        send(name, search->coordinator, [this, search, id = ask->id, made] {
            onServer(search->coordinator, 0, [this, search, id, made](Server&) {
                if (search->ended) return;
                search->answers[id] = made;
                dispatch(search, search->gather->onAnswer(id, made->coverage));
            });
        });
    }

    // Searches -----------------------------------------------------------------------

    void search() {
        if (servers_.empty()) return;
        auto at = servers_.begin();
        std::advance(at, static_cast<std::ptrdiff_t>(random_() % servers_.size()));
        Server& server = *at->second;
        if (!server.routes || server.pausedUntil > database_.now) return;
        const auto search = std::make_shared<Search>();
        search->coordinator = server.name;
        search->atLeast = chance(50) ? database_.number() : 0;
        search->started = database_.now;
        search->deadline = database_.now + kPatience;
        search->gather.emplace(server.routes, search->atLeast, 0, random_());
        dispatch(search, search->gather->start());
    }

    void dispatch(const SearchPtr& search, std::vector<Ask> asks) {
        if (search->ended) return;
        if (search->gather->complete()) return finish(search);
        if (database_.now >= search->deadline) return giveUp(search);
        for (Ask& one : asks) {
            const auto ask = std::make_shared<const Ask>(std::move(one));
            send(search->coordinator, ask->server, [this, search, ask] {
                onAsk(ask->server, search, ask, database_.now + kAnswerTimeout / 2);
            });
            onServer(search->coordinator, kAnswerTimeout,
                     [this, search, id = ask->id](Server&) { failed(search, id); });
        }
        if (search->gather->needsRoutes() && !search->waitsForRoutes) newRoutes(search);
    }

    void failed(const SearchPtr& search, std::uint64_t ask) {
        onServer(search->coordinator, 0, [this, search, ask](Server&) {
            if (!search->ended) dispatch(search, search->gather->onFailure(ask));
        });
    }

    /// What waits for routes gets them from one read, 50 ms after the first began to wait.
    void newRoutes(const SearchPtr& search) {
        search->waitsForRoutes = true;
        onServer(search->coordinator, 0, [this, search](Server& server) {
            server.waiting.push_back(search);
            if (server.waiting.size() > 1) return;
            onServer(server.name, 50, [this](Server& me) { readRoutes(me); });
        });
    }

    void readRoutes(Server& server) {
        const bool reachable = cut_.count({server.name, "database"}) == 0;
        const auto view = reachable ? database_.view() : Result<ClusterView>(tl::make_unexpected(Error{}));
        const RoutesPtr routes = view ? routesOf(*view) : nullptr;
        for (const SearchPtr& search : std::exchange(server.waiting, {})) {
            search->waitsForRoutes = false;
            if (search->ended) continue;
            dispatch(search, routes != nullptr ? search->gather->onRoutes(routes) : std::vector<Ask>());
        }
    }

    void giveUp(const SearchPtr& search) {
        search->ended = true;
        ++outcome_.unavailable;
        if (!outageSince_) outageSince_ = search->started;
    }

    /// The answer that a client would get, compared with the history.
    void finish(const SearchPtr& search) {
        search->ended = true;
        ++outcome_.answers;
        if (outageSince_)
            outcome_.longestOutage = std::max(outcome_.longestOutage, database_.now - *outageSince_);
        outageSince_.reset();
        ShardSet covered;
        std::set<std::int64_t> generations;
        for (const std::uint64_t id : search->gather->accepted()) {
            const Answer& answer = *search->answers.at(id);
            ShardSet shards;
            for (const auto& [shard, epoch] : answer.coverage.shards)
                shards.set(static_cast<std::size_t>(shard));
            if ((covered & shards).any()) return differ("a shard counts twice");
            covered |= shards;
            generations.insert(answer.coverage.generation);
            check(*search, answer, shards);
        }
        if (!covered.all()) differ("a shard is missing");
        if (generations.size() > 1) differ("two generations in one answer");
    }

    void check(const Search& search, const Answer& answer, const ShardSet& shards) {
        const std::int64_t number = answer.coverage.number;
        if (number < search.atLeast) return differ("an answer does not know what it was asked to know");
        // Nobody answers who has not followed for longer than a lease and what keeps one.
        const Time stale = 2 * options_.term + kAnswerTimeout;
        if (number < database_.numberAt(answer.madeAt - stale)) return differ("an answer is stale");
        std::string difference = database_.compare(answer.versions, shards, number, answer.upper);
        if (!difference.empty()) return differ(difference);
        bool served = false;
        for (std::int64_t n = number; n <= answer.upper; ++n) {
            served |= database_.generationAt(n) == answer.coverage.generation;
        }
        if (!served) differ("an answer is of a generation that did not serve");
    }

    void differ(const std::string& what) {
        if (outcome_.difference.empty()) {
            outcome_.difference = what + " (seed " + std::to_string(options_.seed) + ", at " +
                                  std::to_string(database_.now) + " ms)";
        }
    }

    // What happens to them -------------------------------------------------------------

    void write() {
        if (database_.down) return;
        const std::int64_t id = between(1, kShapes);
        if (chance(1)) {
            database_.switchGeneration();
        } else if (chance(30)) {
            database_.remove(id);
        } else {
            database_.put(id);
        }
        if (chance(1)) database_.forgetChanges(database_.number() - 60);
    }

    void fault() {
        ++outcome_.faults;
        if (servers_.empty()) return startServer();
        auto at = servers_.begin();
        std::advance(at, static_cast<std::ptrdiff_t>(random_() % servers_.size()));
        const std::string name = at->first;
        switch (random_() % 6) {
            case 0:
                servers_.erase(at);
                after(between(100, 5'000), [this] { startServer(); });
                break;
            case 1: at->second->pausedUntil = database_.now + between(50, 3 * options_.term); break;
            case 2: cut(name, "database", between(50, 3 * options_.term)); break;
            case 3: {
                auto other = servers_.begin();
                std::advance(other, static_cast<std::ptrdiff_t>(random_() % servers_.size()));
                cut(name, other->first, between(50, 3 * options_.term));
                break;
            }
            case 4:
                database_.down = true;
                after(between(50, 2 * options_.term), [this] { database_.down = false; });
                break;
            case 5: restart(name); break;
        }
    }

    void cut(const std::string& one, const std::string& other, Time length) {
        cut_.insert({one, other});
        after(length, [this, one, other] { cut_.erase({one, other}); });
    }

    /// In order: another is started, then this one leaves, and ends when it has nothing any more.
    void restart(const std::string& name) {
        startServer();
        after(1'000, [this, name] {
            const auto found = servers_.find(name);
            if (found != servers_.end()) found->second->keeper.leave();
        });
        after(5'000, [this, name] { servers_.erase(name); });
    }

    Options options_;
    std::mt19937_64 random_;
    Database database_;
    std::map<std::string, std::unique_ptr<Server>> servers_;
    std::set<std::pair<std::string, std::string>> cut_;
    std::vector<Event> events_;  // a heap, the next one first
    std::uint64_t order_ = 0;
    int started_ = 0;
    std::optional<Time> outageSince_;
    Outcome outcome_;
};

}  // namespace

Outcome simulate(const Options& options) { return World(options).run(); }

}  // namespace shapedb::cluster::sim
