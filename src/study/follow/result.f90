!! What razy-follow found, as a result file and in words.
!!
!! Each motion is a row with its extrema over one period, as in the files of razy-sweep; special points are a table of their own.
module razy_study_follow_result
   use, intrinsic :: ieee_arithmetic, only: ieee_is_finite, ieee_is_nan, ieee_quiet_nan, ieee_value
   use razy_core_error, only: error_t
   use razy_core_kinds, only: i8, wp
   use razy_core_number, only: counted, decimal, to_text
   use razy_core_table, only: table_t
   use razy_core_text, only: append_text, string_t
   use razy_core_verdict, only: is_undecided, verdict_words, verdicts
   use razy_io_result_file, only: new_header
   use razy_io_rows_file, only: rows_file_t
   use razy_machine_machine, only: machine_t
   use razy_motion_integrator, only: observer_slot_t
   use razy_observe_event_log, only: event_log_t
   use razy_observe_extrema, only: extrema_t
   use razy_orbits_curve, only: junction_t
   use razy_orbits_periodic_period_map, only: return_t
   use razy_orbits_branch_point, only: point_t
   use razy_orbits_volume, only: volume_t
   use razy_study_follow_family, only: case_family_t
   use razy_study_follow_follow, only: follow_t
   use razy_study_watch, only: ask_extrema
   implicit none(type, external)
   private

   public :: follow_words, write_follow

contains

   !> Write the file; `input` is the effective input, in which the parameter has the value that the user gave it.
   subroutine write_follow(self, input, path, overwrite, error)
      type(follow_t), intent(inout) :: self
      character(*), intent(in) :: input, path
      logical, intent(in) :: overwrite
      type(error_t), allocatable, intent(out) :: error

      type(rows_file_t) :: file
      type(table_t) :: table
      type(table_t), allocatable :: row(:)
      integer(i8), allocatable :: lengths(:)
      integer :: b, i, k, n

      ! What was found is written, whatever comes.
      self%problem%map%stop_is_asked => null()
      n = sum(self%branch(:self%count)%count)
      allocate (row(0:n))
      call describe_row(self, row(0))
      k = 0
      do b = 1, self%count
         do i = 1, self%branch(b)%count
            k = k + 1
            call fill_row(self, b, self%branch(b)%point(i), row(k), error)
            if (allocated(error)) return
         end do
      end do
      lengths = [(0_i8, i=1, row(0)%count)]
      do k = 1, n
         lengths = lengths + [(product(row(k)%column(i)%extent), i=1, row(k)%count)]
      end do
      call branch_columns(self, table)
      call special_columns(self, table)
      call self%sensitivities%columns(table, self%varied(1))
      call curve_columns(self, table, error)
      if (allocated(error)) return
      call sample_columns(self, table)
      select type (family => self%problem%map%family)
      type is (case_family_t)
         call file%begin(path, new_header("razy-follow", family%machine%title, family%motion%method%integrator, &
                                          family%motion%method%treatment, input), table, row(0), int(n, i8), lengths, error)
      end select
      do k = 1, n
         if (.not. allocated(error)) call file%append(row(k), error)
      end do
      call file%commit(overwrite, error)
   end subroutine write_follow

   !> A motion: what it is, its multipliers and its extrema over one period.
   subroutine fill_row(self, branch, point, row, error)
      type(follow_t), intent(inout) :: self
      integer, intent(in) :: branch
      type(point_t), intent(in) :: point
      type(table_t), intent(inout) :: row
      type(error_t), allocatable, intent(out) :: error

      type(extrema_t), allocatable, target :: extrema(:)
      type(observer_slot_t), allocatable :: slots(:)
      type(return_t) :: back
      type(volume_t), target :: volume
      real(wp), allocatable :: s(:)
      real(wp) :: duration
      integer :: i

      associate (orbit => point%orbit, map => self%problem%map)
         self%problem%periods = self%branch(branch)%periods
         s = self%problem%scales()
         self%problem%parameter(1) = self%problem%value_of(orbit)
         map%phase = orbit%phase
         call map%go_to(self%problem%parameter, error)
         if (allocated(error)) return
         duration = self%problem%periods*map%period
         if (self%problem%is_autonomous()) duration = orbit%u(map%n + 1)*self%problem%period
         call ask_of_period(self, extrema)
         allocate (slots(size(extrema) + 1))
         slots(size(slots))%observer => volume
         call volume%begin(map%by)
         do i = 1, size(extrema)
            slots(i)%observer => extrema(i)
         end do
         associate (n => self%problem%states())
            call map%go(orbit%u(:n)*s(:n), duration, .false., back, slots)
         end associate
         call motion_columns(self, branch, self%problem%periods, duration, volume, point, back%sequence, extrema, row)
      end associate
   end subroutine fill_row

   !> The columns of a row, whatever was found.
   subroutine describe_row(self, row)
      type(follow_t), intent(inout) :: self
      type(table_t), intent(inout) :: row

      type(extrema_t), allocatable :: extrema(:)
      type(point_t) :: rest
      type(volume_t) :: volume

      rest%orbit%u = spread(0.0_wp, 1, self%problem%order() + 1)
      rest%orbit%multiplier = spread((0.0_wp, 0.0_wp), 1, self%problem%multipliers())
      rest%orbit%doubt = spread(0.0_wp, 1, self%problem%multipliers())
      call ask_of_period(self, extrema)
      call rest%orbit%sequence%forget()
      call motion_columns(self, 0, 0, 0.0_wp, volume, rest, rest%orbit%sequence, extrema, row)
   end subroutine describe_row

   !> The extrema that are recorded, of a whole period.
   subroutine ask_of_period(self, extrema)
      type(follow_t), intent(in) :: self
      type(extrema_t), allocatable, intent(out) :: extrema(:)

      integer :: i

      select type (family => self%problem%map%family)
      type is (case_family_t)
         call ask_extrema(extrema, family%records)
      end select
      do i = 1, size(extrema)
         extrema(i)%from = 0.0_wp
         call extrema(i)%forget()
      end do
   end subroutine ask_of_period

   subroutine motion_columns(self, branch, periods, duration, volume, point, sequence, extrema, row)
      type(follow_t), intent(in) :: self
      integer, intent(in) :: branch, periods
      real(wp), intent(in) :: duration
      type(volume_t), intent(in) :: volume
      type(point_t), intent(in) :: point
      type(event_log_t), intent(in) :: sequence
      type(extrema_t), intent(in) :: extrema(:)
      type(table_t), intent(inout) :: row

      character(*), parameter :: group = "/point/"
      real(wp), allocatable :: s(:), state(:)
      real(wp) :: missed
      integer :: i, stability

      associate (map => self%problem%map)
         s = self%problem%scales()
         state = map%to_coordinates(point%orbit%u(:map%n)*s(:map%n))
      end associate
      stability = point%orbit%stability()
      ! Located where a multiplier comes to the circle.
      if (any(point%label == ["LP", "BP", "PD", "TR", "HB"])) stability = is_undecided
      call row%add(group//"branch", branch, "1", "number of the branch")
      call row%add(group//self%varied(1)%dotted(), self%problem%value_of(point%orbit), self%varied(1)%unit, &
                   self%varied(1)%parameter)
      call row%add(group//"period", duration, "s", "period of the motion")
      call row%add(group//"multiplicity", periods, "1", "periods of the excitation in one of the motion")
      call row%add(group//"stable", stability, "1", "whether all multipliers are within the unit circle")
      call row%note_meanings(verdicts(:3), verdict_words(:3))
      call row%add(group//"multiplier", reshape([real(point%orbit%multiplier, wp), point%orbit%multiplier%im], &
                                                [size(point%orbit%multiplier), 2]), "1", "Floquet multipliers", &
                   [character(16) :: group//"order", group//"part"])
      call row%add(group//"multiplier_error", point%orbit%doubt, "1", "how far each multiplier may be off", group//"order", &
                   fixed=.true.)
      ! Of a multiplier that is smaller than its error there is no logarithm.
      missed = ieee_value(1.0_wp, ieee_quiet_nan)
      associate (mu => abs(point%orbit%multiplier))
         if (all(mu > point%orbit%doubt)) missed = sum(log(mu)) - volume%logarithm
      end associate
      call row%add(group//"determinant_error", missed, "1", &
                   "logarithm of the product of the multipliers, less that by the trace of the damping and the impacts")
      call row%add(group//"state", state, "mixed", "displacements and velocities at /point/phase", &
                   group//"coordinate", fixed=.true.)
      call row%add(group//"phase", point%orbit%phase, "1", "part of the period of the excitation at which the state stands")
      call row%add(group//"events", point%orbit%sequence%count, "1", "changes of branch of contacts in a period")
      call row%add(group//"correction", point%orbit%correction, "1", "last correction by Newton's method, relative to the state")
      select type (family => self%problem%map%family)
      type is (case_family_t)
         do i = 1, size(extrema)
            call extrema(i)%columns(row, family%machine)
         end do
         call sequence%columns(row, family%machine)
      end select
   end subroutine motion_columns

   !> Where each branch comes from and why it ends.
   subroutine branch_columns(self, table)
      type(follow_t), intent(in) :: self
      type(table_t), intent(inout) :: table

      character(*), parameter :: along = "/branch/branch"
      character(200) :: ending(self%count)
      integer :: i

      do i = 1, self%count
         ending(i) = self%branch(i)%ending
      end do
      associate (branch => self%branch(:self%count))
         call table%add("/branch/parent", branch%parent, "1", "branch that it begins on; 0: none", along)
         call table%add("/branch/ending", ending, "1", "why it ends", along)
         call table%add("/branch/unexplained", branch%unexplained, "1", "steps in which more changes than its labels say", along)
      end associate
   end subroutine branch_columns

   !> The special points.
   subroutine special_columns(self, table)
      type(follow_t), intent(in) :: self
      type(table_t), intent(inout) :: table

      character(*), parameter :: group = "/special/", along = "/special/special"
      character(2), allocatable :: label(:)
      character(64), allocatable :: contact(:)
      character(64) :: name
      integer, allocatable :: branch(:), place(:)
      real(wp), allocatable :: error(:), parameter(:)
      integer :: b, i, k

      allocate (label(0), contact(0), branch(0), place(0), parameter(0), error(0))
      k = 0
      do b = 1, self%count
         do i = 1, self%branch(b)%count
            k = k + 1
            associate (point => self%branch(b)%point(i))
               if (point%label == "") cycle
               label = [label, point%label]
               name = self%contact_name(point%contact)
               contact = [contact, name]
               branch = [branch, b]
               place = [place, k - 1]
               parameter = [parameter, self%problem%value_of(point%orbit)]
               error = [error, point%error]
            end associate
         end do
      end do
      call table%add(group//"label", label, "1", "LP fold, PD period doubling, TR torus, BP branch point, GR grazing, ST, SL "// &
                     "sticking or sliding begins or ends, CH another change of contacts, UZ a value of "// &
                     "the user's, EP end, MX no motion further on", along)
      call table%add(group//"parameter", parameter, self%varied(1)%unit, self%varied(1)%parameter, along)
      if (self%problem%resolution > 0.0_wp .or. any(pack(error, ieee_is_finite(error)) > 0.0_wp)) then
         call table%add(group//"error", error, self%varied(1)%unit, "how far it may be off", along)
      end if
      call table%add(group//"branch", branch, "1", "number of the branch", along)
      call table%add(group//"point", place, "1", "row of /point, from 0", along)
      call table%add(group//"contact", contact, "1", "the contact that it is about", along)
   end subroutine special_columns

   !> The curves over two parameters: what each is, and all their points one after the other.
   subroutine curve_columns(self, table, error)
      type(follow_t), intent(inout) :: self
      type(table_t), intent(inout) :: table
      type(error_t), allocatable, intent(out) :: error

      character(*), parameter :: along = "/curve/curve", points = "/curve_point/point"
      character(2) :: label(self%curves)
      character(64) :: contact(self%curves)
      real(wp), allocatable :: largest(:), phase(:), place(:, :), s(:), state(:, :)
      integer, allocatable :: curve(:)
      integer :: i, k

      if (size(self%varied) < 2) return
      allocate (largest(0), phase(0), place(2, 0), curve(0))
      associate (map => self%problem%map)
         allocate (state(size(map%to_coordinates(spread(0.0_wp, 1, map%n))), sum(self%curve(:self%curves)%count)))
      end associate
      s = self%problem%scales()
      do i = 1, self%curves
         associate (one => self%curve(i))
            label(i) = one%label
            contact(i) = self%contact_name(one%contact)
            do k = 1, one%count
               call self%problem%map%go_to([one%place(:, k), self%problem%parameter(3:)], error)
               if (allocated(error)) return
               curve = [curve, i]
               associate (x => one%motion(:self%problem%map%n, k))
                  state(:, size(curve)) = self%problem%map%to_coordinates(x*s(:size(x)))
               end associate
            end do
            largest = [largest, one%largest]
            phase = [phase, one%phase]
            place = reshape([place, one%place], [2, size(curve)])
         end associate
      end do
      call table%add("/curve/label", label, "1", "kind of the special points, as in /special", along)
      call table%add("/curve/contact", contact, "1", "the contact that they are about", along)
      call table%add("/curve/branch", self%curve(:self%curves)%branch, "1", "branch that the curve was found on", along)
      call table%add("/curve/multiplicity", self%curve(:self%curves)%periods, "1", "periods of the excitation in a motion", along)
      call table%add("/curve_point/curve", curve, "1", "number of the curve", points)
      do i = 1, 2
         associate (varied => self%varied(i))
            call table%add("/curve_point/"//varied%dotted(), place(i, :), varied%unit, varied%parameter, points)
         end associate
      end do
      call table%add("/curve_point/largest_multiplier", largest, "1", "modulus of the largest Floquet multiplier", points)
      call table%add("/curve_point/state", state, "mixed", "displacements and velocities at /curve_point/phase", &
                     [character(24) :: "/curve_point/coordinate", points])
      call table%add("/curve_point/phase", phase, "1", "part of the period of the excitation at which the state stands", points)
      call junction_columns(self, table)
   end subroutine curve_columns

   !> Where two things happen at once on a curve.
   subroutine junction_columns(self, table)
      type(follow_t), intent(in) :: self
      type(table_t), intent(inout) :: table

      character(*), parameter :: along = "/junction/junction"
      type(junction_t), allocatable :: junction(:)
      integer, allocatable :: curve(:)
      integer :: i, k

      allocate (junction(0), curve(0))
      do i = 1, self%curves
         junction = [junction, self%curve(i)%junction]
         curve = [curve, [(i, k=1, size(self%curve(i)%junction))]]
      end do
      call table%add("/junction/label", junction%label, "1", "CP cusp, R1 to R4 resonances, LPPD fold and doubling, GRLP, "// &
                     "GRPD grazing at a fold, a doubling", along)
      call table%add("/junction/curve", curve, "1", "number of the curve", along)
      do i = 1, 2
         associate (varied => self%varied(i))
            call table%add("/junction/"//varied%dotted(), junction%place(i), varied%unit, varied%parameter, along)
         end associate
      end do
   end subroutine junction_columns

   !> Of all motions: what was seen at the values at which they were looked for, and how many starts settled to which.
   subroutine sample_columns(self, table)
      type(follow_t), intent(in) :: self
      type(table_t), intent(inout) :: table

      character(*), parameter :: along = "/sample/sample", settled = "/basin/basin"
      integer, allocatable :: branch(:), sample(:), starts(:)
      integer :: i, k

      if (.not. self%all_motions) return
      allocate (branch(0), sample(0), starts(0))
      do i = 1, size(self%sample)
         branch = [branch, self%sample(i)%branch]
         sample = [sample, [(i - 1, k=1, size(self%sample(i)%branch))]]
         starts = [starts, self%sample(i)%starts]
      end do
      associate (varied => self%varied(1), seen => self%sample)
         call table%add("/sample/"//varied%dotted(), seen%parameter, varied%unit, varied%parameter, along)
         call table%add("/sample/lyapunov", seen%exponent, "1/s", "largest Lyapunov exponent of the machine's own motion", along)
         call table%add("/sample/lyapunov_error", seen%error, "1/s", "standard error of the exponent", along)
         call table%add("/sample/unsettled", seen%unsettled, "1", "starts that settle to no periodic motion", along)
      end associate
      call table%add("/basin/sample", sample, "1", "row of /sample, from 0", settled)
      call table%add("/basin/branch", branch, "1", "branch that starts settle to", settled)
      call table%add("/basin/starts", starts, "1", "how many of them", settled)
   end subroutine sample_columns

   !> One line for each special point, as AUTO prints them, and one for the end of each branch.
   function follow_words(self) result(lines)
      type(follow_t), intent(in) :: self
      type(string_t), allocatable :: lines(:)

      integer :: b, i, k

      allocate (lines(0))
      if (.not. (self%settled .or. self%all_motions)) then
         call append_text(lines, "the start settles to no motion of such a period: that which it comes nearest to is followed")
      end if
      call append_text(lines, "branch  point  label  "//self%varied(1)%parameter//" ("//self%varied(1)%unit// &
                       ")  periods  largest multiplier  contact")
      do b = 1, self%count
         do i = 1, self%branch(b)%count
            associate (point => self%branch(b)%point(i))
               if (point%label == "") cycle
               call append_text(lines, right(to_text(b), 6)//right(to_text(i), 7)//right(point%label, 7)//"  "// &
                                right(decimal(self%problem%value_of(point%orbit), decimals(point%error)), 20)// &
                                right(to_text(self%branch(b)%periods), 6)// &
                                "  "//right(decimal(maxval([0.0_wp, abs(point%orbit%multiplier)]), 6), 12)//"  "// &
                                self%contact_name(point%contact))
            end associate
         end do
         call append_text(lines, "branch "//to_text(b)//" ends: "//self%branch(b)%ending)
         if (self%branch(b)%unexplained == 0) cycle
         call append_text(lines, "branch "//to_text(b)//": in "//counted(to_text(self%branch(b)%unexplained), "step")// &
                          " more changes than its labels say")
      end do
      call self%sensitivities%words(lines, self%branch(:self%count), self%varied(1))
      do i = 1, self%curves
         associate (curve => self%curve(i))
            call append_text(lines, "curve "//to_text(i)//": "//curve%label//" of branch "//to_text(curve%branch)//", "// &
                             counted(to_text(curve%count), "point")//", "//self%varied(1)%parameter//" "// &
                             decimal(minval(curve%place(1, :)), 7)//" to "//decimal(maxval(curve%place(1, :)), 7)//", "// &
                             self%varied(2)%parameter//" "//decimal(minval(curve%place(2, :)), 7)//" to "// &
                             decimal(maxval(curve%place(2, :)), 7)//"; ends: "//curve%ending(1)%text//"; "//curve%ending(2)%text)
            do k = 1, size(curve%junction)
               associate (junction => curve%junction(k))
                  call append_text(lines, "curve "//to_text(i)//": "//trim(junction%label)//" at "//self%varied(1)%parameter// &
                                   " "//decimal(junction%place(1), 12)//", "//self%varied(2)%parameter//" "// &
                                   decimal(junction%place(2), 12))
               end associate
            end do
         end associate
      end do
   end function follow_words

   !> Decimals that are printed of a number with this error.
   pure integer function decimals(error)
      real(wp), intent(in) :: error

      integer, parameter :: most = 12, of_unknown = 6

      decimals = most
      if (ieee_is_nan(error)) then
         decimals = of_unknown
      else if (error > 0.0_wp) then
         decimals = max(0, min(most, floor(-log10(error))))
      end if
   end function decimals

   pure function right(text, width)
      character(*), intent(in) :: text
      integer, intent(in) :: width
      character(:), allocatable :: right

      right = repeat(" ", max(width - len_trim(text), 0))//trim(text)
   end function right

end module razy_study_follow_result
