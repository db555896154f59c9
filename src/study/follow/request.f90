!! What &follow asks for: what is varied and how far, where the first motion is looked for, and the machine that is followed.
module razy_study_follow_request
   use razy_core_error, only: error_t, raise
   use razy_core_kinds, only: wp
   use razy_core_number, only: counted, to_text
   use razy_core_text, only: append_text, string_t
   use razy_input_input, only: input_t
   use razy_machine_machine, only: contact_rows, machine_t
   use razy_orbits_periodic_problem, only: problem_t
   use razy_orbits_search, only: search_t
   use razy_study_follow_family, only: case_family_t, is_of_machine
   use razy_study_follow_sensitivities, only: new_sensitivities, sensitivities_t
   use razy_study_follow_stored, only: read_stored, stored_motion_t
   use razy_study_sweep_axes, only: check_apart, new_varied, varied_t
   implicit none(type, external)
   private

   public :: new_request, request_t, same

   type :: request_t
      type(problem_t) :: problem
      !> What each &follow says: what varies (1 or 2), from where to where.
      type(varied_t), allocatable :: varied(:)
      real(wp), allocatable :: first(:), last(:)
      !> Values of the first parameter at which motions are stored whatever the steps.
      real(wp), allocatable :: values(:)
      real(wp) :: from = 0.0_wp
      type(sensitivities_t) :: sensitivities
      !> A motion of another file that the first branch begins with.
      type(stored_motion_t), allocatable :: stored
      !> How long the machine may take to settle, s, in how many periods, to a motion of how many (0: what it has).
      real(wp) :: time = 0.0_wp
      integer :: period = 0, most_points = 0, settle = 0
      integer :: doublings = 0
      !> All motions are wanted, looked for at so many values of the parameter, and how.
      logical :: all_motions = .false.
      integer :: samples = 0
      type(search_t) :: search
   contains
      procedure :: plan
      procedure :: is_beyond
   end type request_t

   !> Values of the parameter nearer than this, in its range, are one.
   real(wp), parameter :: same = 1.0e-8_wp
   !> What equal values of a machine are changed by, in parts of them, each more than the one before.
   real(wp), parameter :: aside = 1.0e-3_wp

contains

   !> Read &follow, and make the first machine.
   subroutine new_request(request, input, error)
      class(request_t), intent(out) :: request
      type(input_t), intent(in) :: input
      type(error_t), allocatable, intent(out) :: error

      type(case_family_t) :: family
      type(error_t), allocatable :: problem
      integer :: i, n

      n = input%count("follow")
      if (n == 0) then
         call input%complain(error, "follow", 1, "parameter", "required: the group%key that razy-follow varies")
         return
      else if (n > 2) then
         call input%complain(error, "follow", 3, "parameter", "at most two &follow groups, one for each parameter")
         return
      end if
      allocate (request%varied(n), request%first(n), request%last(n))
      do i = 1, n
         call read_parameter(request, input, i, error)
         if (.not. allocated(error) .and. i == 2) call check_apart(request%varied, input, "follow", error)
         if (allocated(error)) return
      end do
      call new_sensitivities(request%sensitivities, input, request%varied, error)
      if (allocated(error)) return
      family%input = input
      allocate (family%varied(n + size(request%sensitivities%key)))
      family%varied(:n) = request%varied
      family%varied(n + 1:) = request%sensitivities%key
      call read_from(request, input, error)
      if (allocated(error)) return
      call input%get("follow", 1, "values", request%values)
      if (any((request%values - request%first(1))*(request%values - request%last(1)) > 0.0_wp)) then
         call input%complain(error, "follow", 1, "values", "values between first and last")
         return
      end if
      call input%get("follow", 1, "period", request%period)
      call input%get("follow", 1, "doublings", request%doublings)
      call input%get("follow", 1, "max_points", request%most_points)
      call input%get("follow", 1, "settle", request%settle)
      call read_all(request, input, error)
      if (allocated(error)) return
      request%problem%map%family = family
      request%problem%parameter = [(family%varied(i)%slot(1)%number, i=1, size(family%varied))]
      call make_machines(request, problem)
      if (allocated(problem)) then
         ! What says its own place is no fault of the parameter.
         if (index(problem%message, ": &") > 0) call move_alloc(problem, error)
         if (allocated(problem)) call input%complain(error, "follow", 1, "parameter", problem%message)
         return
      end if
      if (allocated(request%stored)) call check_stored(request, input, error)
      if (allocated(error)) return
      if (request%all_motions .and. request%problem%is_autonomous()) then
         call input%complain(error, "follow", 1, "motions", "'one': all motions are looked for where there is an excitation")
         return
      end if
      select type (made => request%problem%map%family)
      type is (case_family_t)
         request%time = made%motion%t_end
         if (made%motion%method%integrator /= "exact") call request%problem%take_steps(made%motion%method%relative_tolerance)
      end select
   end subroutine new_request

   !> Make the machine at the end of the range and where the first motion is looked for. Where masses, springs, dampers or contacts'
   !> directions vary, coordinates are those that are linked, since of equal halves fewer are felt; where links vanish, all.
   subroutine make_machines(self, error)
      class(request_t), intent(inout) :: self
      type(error_t), allocatable, intent(out) :: error

      type(error_t), allocatable :: refused
      type(machine_t) :: ends
      integer :: unknowns, i

      associate (map => self%problem%map, values => self%problem%parameter)
         do
            values(1) = self%last(1)
            call map%go_to(values, error)
            if (allocated(error)) return
            ends = map%by%system%machine
            unknowns = map%n
            values(1) = self%from
            call map%go_to(values*[(1.0_wp + aside*i, i=1, size(values))], refused)
            if (allocated(refused)) call map%go_to(values, error)
            if (allocated(error)) return
            select type (family => map%family)
            type is (case_family_t)
               if (.not. family%linked) then
                  family%linked = .not. alike(ends, map%by%system%machine)
                  if (family%linked) cycle
               end if
               call map%go_to(values, error)
               if (allocated(error)) return
               if (family%keep_all .or. .not. family%linked .or. map%n == unknowns) exit
               family%keep_all = .true.
            end select
         end do
         if (map%n > 0) return
         call raise(error, "no contact, and no &record but that of the state, feels a motion that springs or dampers "// &
                    "resist: record a displacement")
      end associate
   end subroutine make_machines

   !> Whether two machines have the same matrices and directions of contacts.
   pure logical function alike(a, b)
      type(machine_t), intent(in) :: a, b

      alike = size(a%contact) == size(b%contact)
      if (alike) alike = .not. any(abs([a%mass - b%mass, a%damping - b%damping, a%stiffness - b%stiffness, &
                                        contact_rows(a%contact) - contact_rows(b%contact)]) > 0.0_wp)
   end function alike

   !> Where the first motion is looked for, and the stored one near which it is.
   subroutine read_from(self, input, error)
      class(request_t), intent(inout) :: self
      type(input_t), intent(in) :: input
      type(error_t), allocatable, intent(out) :: error

      logical :: given

      given = input%given("follow", 1, "from")
      self%from = self%first(1)
      call read_stored(self%stored, input, self%varied(1)%dotted(), error)
      if (allocated(error)) return
      if (allocated(self%stored)) then
         if (self%stored%has_parameter) self%from = self%stored%parameter
      end if
      if (given) call input%get("follow", 1, "from", self%from)
      if (self%is_beyond(self%from)) then
         if (given) then
            call input%complain(error, "follow", 1, "from", "a value between first and last")
         else
            call input%complain(error, "follow", 1, "start_file", "a motion between first and last; this one is at "// &
                                to_text(self%from))
         end if
      end if
   end subroutine read_from

   !> Refuse a stored motion of another machine, or of other periods than those that are asked for.
   subroutine check_stored(self, input, error)
      class(request_t), intent(in) :: self
      type(input_t), intent(in) :: input
      type(error_t), allocatable, intent(out) :: error

      integer :: coordinates

      select type (family => self%problem%map%family)
      type is (case_family_t)
         coordinates = size(family%machine%displacement)
         if (size(self%stored%state) /= 2*coordinates) then
            call input%complain(error, "follow", 1, "start_file", "a file of a machine with as many coordinates, "// &
                                to_text(coordinates)//"; its has "//to_text(size(self%stored%state)/2))
         else if (self%period > 0 .and. self%period /= self%stored%periods) then
            call input%complain(error, "follow", 1, "period", "not with start_file, or that of its motion, "// &
                                to_text(self%stored%periods))
         end if
      end select
   end subroutine check_stored

   !> Whether a value is outside the range by more than rounding.
   pure logical function is_beyond(self, value)
      class(request_t), intent(in) :: self
      real(wp), intent(in) :: value

      associate (first => self%first(1), last => self%last(1))
         is_beyond = max(min(first, last) - value, value - max(first, last)) > same*abs(last - first)
      end associate
   end function is_beyond

   !> Whether all motions are wanted, and where they are looked for.
   subroutine read_all(self, input, error)
      class(request_t), intent(inout) :: self
      type(input_t), intent(in) :: input
      type(error_t), allocatable, intent(out) :: error

      !> Periods of a motion that are looked for if nothing is said.
      integer, parameter :: usual_periods = 4
      character(*), parameter :: of_all(*) = [character(7) :: "samples", "starts"]
      integer :: i

      self%all_motions = input%choice("follow", 1, "motions") == "all"
      call input%get("follow", 1, "samples", self%samples)
      call input%get("follow", 1, "starts", self%search%starts)
      self%search%settle = self%settle
      self%search%most_periods = merge(self%period, usual_periods, self%period > 0)
      if (self%all_motions .and. allocated(self%stored)) then
         call input%complain(error, "follow", 1, "start_file", "not with motions='all', which begins everywhere")
      else if (self%all_motions .and. size(self%sensitivities%key) > 0) then
         call input%complain(error, "follow", 1, "sensitivities", "not with motions='all': of one motion, as start_file gives it")
      else if (self%all_motions .and. size(self%varied) > 1) then
         call input%complain(error, "follow", 1, "motions", "'one': curves over two parameters begin on the branches of one motion")
      else if (self%all_motions .and. input%given("follow", 1, "from")) then
         call input%complain(error, "follow", 1, "from", "not with motions='all', which looks at samples= values")
      else if (self%all_motions .and. self%settle < 2*self%search%most_periods) then
         call input%complain(error, "follow", 1, "settle", "at least twice the periods of a motion")
      end if
      if (allocated(error) .or. self%all_motions) return
      i = findloc([(input%differs("follow", 1, trim(of_all(i))), i=1, size(of_all))], .true., dim=1)
      if (i > 0) call input%complain(error, "follow", 1, trim(of_all(i)), "only with motions='all'")
   end subroutine read_all

   !> What &follow number i varies, and its range.
   subroutine read_parameter(self, input, i, error)
      class(request_t), intent(inout) :: self
      type(input_t), intent(in) :: input
      integer, intent(in) :: i
      type(error_t), allocatable, intent(out) :: error

      character(*), parameter :: common(*) = [character(13) :: "from", "start_file", "start_point", "start_label", "period", &
                                                                               "settle", "doublings", "max_points", "sensitivities"]
      integer :: k

      call new_varied(self%varied(i), input, "follow", i, error)
      if (allocated(error)) return
      associate (slot => self%varied(i)%slot)
         do k = 1, size(slot)
            if (slot(k)%whole) then
               call input%complain(error, "follow", i, "parameter", "a real number: motions are followed over a continuous value")
            else if (.not. is_of_machine(slot(k)%path)) then
               call input%complain(error, "follow", i, "parameter", "a value that the machine has")
            end if
            if (allocated(error)) return
         end do
      end associate
      call input%get("follow", i, "first", self%first(i))
      call input%get("follow", i, "last", self%last(i))
      associate (first => self%first(i), last => self%last(i), now => self%varied(i)%slot(1)%number)
         if (.not. abs(last - first) > 1.0e-9_wp*max(abs(first), abs(last))) then
            call input%complain(error, "follow", i, "last", "a value apart from first")
         else if (i == 2 .and. (now - first)*(now - last) > 0.0_wp) then
            call input%complain(error, "follow", 2, "first", "a range that holds "//to_text(now)//", the value that "// &
                                self%varied(2)%parameter//" has in the input")
         end if
      end associate
      if (i == 1 .or. allocated(error)) return
      k = findloc([(input%differs("follow", 2, trim(common(k))), k=1, size(common))], .true., dim=1)
      if (k > 0) call input%complain(error, "follow", 2, trim(common(k)), "given in the first &follow only")
   end subroutine read_parameter

   !> What is going to be done, in lines.
   function plan(self) result(lines)
      class(request_t), intent(in) :: self
      type(string_t), allocatable :: lines(:)

      integer :: i, k

      allocate (lines(0))
      do i = 1, size(self%varied)
         associate (varied => self%varied(i))
            call append_text(lines, "parameter: "//varied%parameter//" from "//to_text(self%first(i))//" to "// &
                             to_text(self%last(i))//" "//varied%unit)
            do k = 2, size(varied%slot)
               call append_text(lines, "           with "//varied%slot(k)%path//", "//to_text(varied%factor(k))//" times it")
            end do
         end associate
      end do
      if (self%all_motions) then
         call append_text(lines, "starts: at "//counted(to_text(self%samples), "value")//", of motions of up to "// &
                          counted(to_text(self%search%most_periods), "period"))
      else if (allocated(self%stored)) then
         call append_text(lines, "starts: at "//to_text(self%from)//", with point "//to_text(self%stored%point)//" of "// &
                          self%stored%file//", of period "//to_text(self%stored%periods))
      else
         call append_text(lines, "starts: at "//to_text(self%from)//", with what the machine settles to")
      end if
      call append_text(lines, "branches: of at most "//counted(to_text(self%most_points), "point")// &
                       ", doublings followed "//counted(to_text(self%doublings), "time")//" in a row")
      if (size(self%values) > 0) call append_text(lines, "values: "//to_text(size(self%values))//" at which motions are stored")
      do i = 1, size(self%sensitivities%key)
         call append_text(lines, "sensitivities: to "//self%sensitivities%key(i)%parameter)
      end do
   end function plan

end module razy_study_follow_request
