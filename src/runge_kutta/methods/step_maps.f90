!! Steps of an explicit Runge-Kutta method in a mode whose forces are in its matrices (razy_hybrid_mode), as linear maps.
!!
!! There a step h that starts with the slope z' takes u = (z', cos φ_t…, sin φ_t…), with the phases φ_t of excitation at its start,
!! to
!!
!!     z(t + h) - z = Δ u,   errors E u,   coefficients r_4… of the dense output D u,
!!
!! with matrices that depend on the mode and on h alone. Their columns are the sums of the stages begun with unit vectors, so
!! that a step by its map is that of the stages to rounding. A map costs about as many steps as it has columns, and is made
!! when its step has served as often as that. Steps are therefore drawn from a ladder (razy_runge_kutta_methods_step_ladder).
!!
!! All is forgotten at the start of a run, so that no run depends on another.
module razy_runge_kutta_methods_step_maps
   use razy_core_kinds, only: wp
   use razy_hybrid_field, only: field_t
   use razy_runge_kutta_methods_stage_sums, only: multiply, width
   use razy_runge_kutta_methods_step_ladder, only: slot_of
   use razy_runge_kutta_methods_step_map, only: step_map_t
   use razy_runge_kutta_methods_step_strip, only: step_strip_t
   use razy_runge_kutta_methods_tableaux, only: tableau_t
   implicit none(type, external)
   private

   public :: step_maps_t

   !> Modes that are remembered, and steps of each.
   integer, parameter :: most_modes = 64, most_steps = 32

   !> The steps of the mode with these branches.
   type :: mode_maps_t
      integer, allocatable :: branch(:)
      !> Steps, and where those that have a map are.
      type(step_map_t), allocatable :: step(:)
      integer :: slots = 0, slot(most_steps) = 0
   end type mode_maps_t

   type :: step_maps_t
      !> What the last `try` gave (rows of Δ and E), and the argument u.
      real(wp), allocatable :: ends(:), u(:)
      type(mode_maps_t), private, allocatable :: mode(:)
      integer, private :: now = 0, used = 0
      !> The step looked up last in this mode (0: none), where it is kept, and whether there is a map of it.
      real(wp), private :: h = 0.0_wp
      integer, private :: slot = -1
      logical, private :: ready = .false.
   contains
      procedure :: forget
      procedure :: enter
      procedure :: try
      procedure :: turn
      procedure :: begin
      procedure :: walk
      procedure :: recall
      procedure :: dense
   end type step_maps_t

contains

   !> Forget all maps.
   subroutine forget(self)
      class(step_maps_t), intent(inout) :: self

      self%now = 0
      self%used = 0
      self%h = 0.0_wp
   end subroutine forget

   !> The mode of the field has changed: look its maps up. Modes beyond the first that fit have none.
   subroutine enter(self, field)
      class(step_maps_t), intent(inout) :: self
      type(field_t), intent(in) :: field

      integer :: i

      self%now = 0
      self%h = 0.0_wp
      if (.not. field%folded) return
      if (.not. allocated(self%mode)) allocate (self%mode(most_modes))
      do i = 1, self%used
         if (any(self%mode(i)%branch /= field%branch)) cycle
         self%now = i
         return
      end do
      if (self%used == most_modes) return
      self%used = self%used + 1
      self%now = self%used
      self%mode(self%now)%branch = field%branch
      self%mode(self%now)%slots = 0
      if (.not. allocated(self%mode(self%now)%step)) allocate (self%mode(self%now)%step(0:most_steps - 1))
      do i = 0, most_steps - 1
         self%mode(self%now)%step(i)%h = 0.0_wp
         self%mode(self%now)%step(i)%made = .false.
      end do
   end subroutine enter

   !> A step h with the slope dz at its start, that of the field's step, if there is a map of it: `done`, with Δ u and E u in
   !> `ends`. If not, one is made when it has been asked for often enough.
   subroutine try(self, field, tableau, h, dz, done)
      class(step_maps_t), intent(inout) :: self
      type(field_t), intent(in) :: field
      type(tableau_t), intent(in) :: tableau
      real(wp), intent(in) :: h
      real(wp), intent(in), contiguous :: dz(:)
      logical, intent(out) :: done

      if (abs(h - self%h) > 0.0_wp .or. .not. self%ready) call look_up(self, field, tableau, h)
      done = self%ready
      if (.not. done) return
      call fill(size(dz), size(field%omega), dz, field%base_cosine, field%base_sine, self%u)
      associate (map => self%mode(self%now)%step(self%slot))
         call multiply(size(map%ends, 3), size(map%ends, 2), map%ends, self%u, self%ends)
      end associate

   contains

      pure subroutine fill(n, tones, dz, c, d, u)
         integer, intent(in) :: n, tones
         real(wp), intent(in) :: dz(n), c(tones), d(tones)
         real(wp), intent(inout) :: u(n + 2*tones)

         integer :: i

         do i = 1, n
            u(i) = dz(i)
         end do
         do i = 1, tones
            u(n + i) = c(i)
            u(n + tones + i) = d(i)
         end do
      end subroutine fill

   end subroutine try

   !> Turn the phases of the field's step by the angles in the step that `try` has made last, which ends at `tau`.
   pure subroutine turn(self, field, tau)
      class(step_maps_t), intent(in) :: self
      type(field_t), intent(inout) :: field
      real(wp), intent(in) :: tau

      associate (map => self%mode(self%now)%step(self%slot))
         call field%turn_phases(map%cosine, map%sine, tau)
      end associate
   end subroutine turn

   !> Begin a strip of steps h at z with the slope dz and the phases of the field's step: `done`, if there is a map of h.
   subroutine begin(self, field, h, z, dz, strip, done)
      class(step_maps_t), intent(inout) :: self
      type(field_t), intent(in) :: field
      real(wp), intent(in) :: h
      real(wp), intent(in), contiguous :: z(:), dz(:)
      type(step_strip_t), intent(inout) :: strip
      logical, intent(out) :: done

      if (abs(h - self%h) > 0.0_wp) call find(self, h)
      done = self%ready
      if (done) call strip%begin(field, size(self%ends), h, z, dz)
   end subroutine begin

   !> Make steps of the strip up to number `last`.
   pure subroutine walk(self, field, last, strip)
      class(step_maps_t), intent(in) :: self
      type(field_t), intent(in) :: field
      integer, intent(in) :: last
      type(step_strip_t), intent(inout) :: strip

      associate (map => self%mode(self%now)%step(self%slot))
         call strip%walk(field, last, map%ends, map%cosine, map%sine)
      end associate
   end subroutine walk

   !> Take step k of a strip as the one that `try` has made last.
   pure subroutine recall(self, strip, k)
      class(step_maps_t), intent(inout) :: self
      type(step_strip_t), intent(in) :: strip
      integer, intent(in) :: k

      integer :: i

      do i = 1, size(self%u)
         self%u(i) = strip%u(i, k - 1)
      end do
   end subroutine recall

   !> Look for the map of a step h in the present mode; `ready` if there is one, or if it has been asked for so often that it is
   !> made.
   subroutine look_up(self, field, tableau, h)
      class(step_maps_t), intent(inout) :: self
      type(field_t), intent(in) :: field
      type(tableau_t), intent(in) :: tableau
      real(wp), intent(in) :: h

      integer :: columns

      self%ready = .false.
      self%h = h
      if (self%now == 0) return
      self%slot = slot_of(h, most_steps)
      if (self%slot < 0) return
      columns = 2*(field%m + size(field%omega))
      associate (mode => self%mode(self%now), map => self%mode(self%now)%step(self%slot))
         if (.not. abs(map%h - h) <= 0.0_wp) then
            map%h = h
            map%uses = 0
            map%made = .false.
         end if
         map%uses = min(map%uses, columns) + 1
         if (map%uses <= columns .and. .not. map%made) return
         self%ready = .true.
         if (map%made) return
         call map%make(field, tableau, columns)
         if (.not. any(mode%slot(:mode%slots) == self%slot)) then
            mode%slots = mode%slots + 1
            mode%slot(mode%slots) = self%slot
         end if
         if (allocated(self%u)) deallocate (self%u, self%ends)
         allocate (self%u(columns), self%ends(width*size(map%ends, 3)))
      end associate
   end subroutine look_up

   !> Look for the map of a step h among those that have been made in the present mode.
   pure subroutine find(self, h)
      class(step_maps_t), intent(inout) :: self
      real(wp), intent(in) :: h

      integer :: i

      self%ready = .false.
      self%h = h
      if (self%now == 0) return
      associate (mode => self%mode(self%now))
         do i = 1, mode%slots
            if (abs(mode%step(mode%slot(i))%h - h) > 0.0_wp) cycle
            self%slot = mode%slot(i)
            self%ready = mode%step(self%slot)%made
            return
         end do
      end associate
   end subroutine find

   !> Coefficients r_4… of the dense output of the step that `try` has made last, one after the other (n each).
   pure subroutine dense(self, n, r)
      class(step_maps_t), intent(in) :: self
      integer, intent(in) :: n
      real(wp), intent(inout), contiguous :: r(:, :)

      real(wp) :: rows(size(r) + width)
      integer :: i, l

      associate (map => self%mode(self%now)%step(self%slot))
         call multiply(size(map%dense, 3), size(self%u), map%dense, self%u, rows)
      end associate
      do l = 1, size(r, 2)
         do i = 1, n
            r(i, l) = rows((l - 1)*n + i)
         end do
      end do
   end subroutine dense

end module razy_runge_kutta_methods_step_maps
