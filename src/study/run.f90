!! One motion of an input, with what &record asks for, as the table of its result file.
module razy_study_run
   use razy_core_drawing, only: drawing_t
   use razy_core_error, only: error_t
   use razy_core_kinds, only: i8, pi, wp
   use razy_core_number, only: counted, to_text
   use razy_core_table, only: table_t
   use razy_core_text, only: append_text, string_t
   use razy_hybrid_flow, only: flow_t
   use razy_input_input, only: input_t
   use razy_machine_excitation, only: period_of_loads
   use razy_machine_machine, only: machine_t
   use razy_motion_integrator, only: outcome_t, status_inaccurate, status_meanings, status_ok
   use razy_scenes_case, only: motion_t, new_machine
   use razy_scenes_factory, only: draw_scene
   use razy_scenes_records, only: record_t
   use razy_scenes_scene, only: scene_t
   use razy_scenes_start, only: check_start
   use razy_study_sweep_starts, only: new_starts, starts_t
   use razy_study_tune, only: apply_tune
   use razy_study_watch, only: watch_t
   implicit none(type, external)
   private

   public :: new_run, run_t

   !> A motion that an input describes.
   type :: run_t
      type(machine_t) :: machine
      type(motion_t) :: motion
      type(watch_t) :: watch
      type(outcome_t) :: outcome
      type(drawing_t), allocatable, private :: drawing
   contains
      procedure :: compute
      procedure :: columns
      procedure :: answer
      procedure :: words
   end type run_t

contains

   !> Make the machine of an input, and what watches it.
   subroutine new_run(self, input, error)
      type(run_t), intent(out) :: self
      type(input_t), intent(in) :: input
      type(error_t), allocatable, intent(out) :: error

      class(scene_t), allocatable :: scene
      type(record_t), allocatable :: records(:)
      type(input_t) :: tuned
      character(:), allocatable :: unit
      real(wp), allocatable :: value

      tuned = input
      call apply_tune(tuned, value, unit, error)
      if (.not. allocated(error)) call new_machine(self%machine, self%motion, records, tuned, error, scene)
      if (.not. allocated(error)) call apply_single_start(self%machine, input, error)
      if (.not. allocated(error)) call draw_scene(scene, self%drawing, input, error)
      if (allocated(error)) return
      self%watch%in_full = .true.
      self%watch%asks_kind = .true.
      self%watch%periodicity%in_group = "/outcome/"
      call self%watch%ask(records, self%machine, self%motion, error)
   end subroutine new_run

   !> Begin from the start of &starts if that is one alone, as razy-sweep names it for a point; several are for razy-sweep.
   subroutine apply_single_start(machine, input, error)
      type(machine_t), intent(inout) :: machine
      type(input_t), intent(in) :: input
      type(error_t), allocatable, intent(out) :: error

      type(starts_t) :: starts

      call new_starts(starts, machine, input, error)
      if (allocated(error)) return
      if (.not. starts%wanted) return
      if (starts%method /= "list" .or. starts%count /= 1) return
      call starts%apply(machine, 1_i8, 1_i8)
      call check_start(machine, input, error)
   end subroutine apply_single_start

   !> Compute the motion; how it ended is in `outcome`.
   subroutine compute(self, error)
      class(run_t), intent(inout) :: self
      type(error_t), allocatable, intent(out) :: error

      class(flow_t), allocatable :: integrator

      call self%watch%run(self%machine, self%motion, self%outcome, error, integrator)
   end subroutine compute

   !> What was computed, up to where the motion ended.
   subroutine columns(self, table)
      class(run_t), intent(in) :: self
      type(table_t), intent(inout) :: table

      type(table_t) :: outcome

      call self%outcome%columns(outcome, "/outcome/", brief=.false.)
      call outcome%add("/outcome/excitation_period", period_of_loads(self%machine), "s", "period of the excitation; 0 = none")
      call outcome%add("/outcome/fastest_excitation", maxval([0.0_wp, abs(self%machine%tone%omega)])/(2*pi), "Hz", &
                       "largest frequency of the excitation in the motion")
      call self%watch%periodicity%columns(outcome, self%machine)
      call table%stack(outcome, "/outcome/single")
      if (abs(self%machine%acceleration) > 0.0_wp) then
         call table%add("/rotation/time", [0.0_wp, self%outcome%time], "s", "time", "/rotation/time")
         call table%add("/rotation/speed", self%machine%speed + self%machine%acceleration*[0.0_wp, self%outcome%time], "rad/s", &
                        "speed of the rotation, linear between these times", "/rotation/time")
      end if
      call self%watch%columns(table, self%machine)
      if (allocated(self%drawing)) call self%drawing%columns(table)
   end subroutine columns

   !> The largest and smallest values found, and the number of events, in lines.
   function answer(self) result(lines)
      class(run_t), intent(in) :: self
      type(string_t), allocatable :: lines(:)

      character(64) :: range
      integer :: i

      allocate (lines(0))
      do i = 1, size(self%watch%extrema)
         associate (found => self%watch%extrema(i), observable => self%machine%observable(self%watch%extrema(i)%form))
            range = "no extrema"
            if (found%count > 0) write (range, "(es13.6, a, es13.6, 1x, a)") minval(found%value(:found%count)), " to ", &
               maxval(found%value(:found%count)), observable%unit
            call append_text(lines, observable%name//": "//trim(adjustl(range)))
         end associate
      end do
      call append_text(lines, counted(to_text(self%outcome%events), "event"))
   end function answer

   !> What a user has to know of the motion, in lines; none if the model holds, it came to its end and no event was missed nearly.
   function words(self) result(lines)
      class(run_t), intent(in) :: self
      type(string_t), allocatable :: lines(:)

      character(:), allocatable :: mode
      character(7) :: missing
      integer :: j

      allocate (lines(0))
      if (allocated(self%machine%caution)) lines = self%machine%caution
      call self%watch%reach%words(lines)
      associate (outcome => self%outcome)
         if (outcome%near_misses > 0) then
            call append_text(lines, to_text(outcome%near_misses)//trim(merge(" near misses", " near miss  ", &
                                                                             outcome%near_misses > 1))// &
                             ": contacts that closed or opened nearly or barely, by less than the method resolves "// &
                             "(docs/hard_cases.md)")
         end if
         if (outcome%unbalanced > 0) then
            write (missing, "(es7.1)") outcome%residual
            call append_text(lines, "the motion misses the machine's equations and balances by "//missing// &
                             " of the size of their terms, more than rounding or the tolerance (docs/methods.md)")
         end if
         mode = ""
         do j = 1, merge(size(self%machine%contact), 0, outcome%status == status_inaccurate)
            mode = mode//", '"//self%machine%contact(j)%name//"' "// &
                   trim(self%machine%contact(j)%law%branch(outcome%branch(j))%name)
         end do
         if (outcome%status /= status_ok) call append_text(lines, "the motion ended at "//to_text(outcome%time)//" s: "// &
                                                           trim(status_meanings(outcome%status))//mode)
      end associate
   end function words

end module razy_study_run
