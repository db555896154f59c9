!! Steps of an explicit Runge-Kutta method in a mode whose forces are in its matrices (razy_integrate_mode), as linear maps.
!!
!! There a step h that starts with the slope z' takes u = (z', cos φ_t…, sin φ_t…), with the phases φ_t of excitation at its start,
!! to
!!
!!     z(t + h) - z = Δ u,   errors E u,   coefficients r_4… of the dense output D u,
!!
!! with matrices that depend on the mode and on h alone. Their columns are the sums of the stages begun with unit vectors, so
!! that a step by its map is that of the stages to rounding. A map costs about as many steps as it has columns, and is made
!! when its step has served as often as that. Steps are therefore drawn from a ladder of `rungs` to a factor of two.
!!
!! All is forgotten at the start of a run, so that no run depends on another.
module razy_integrate_step_maps
   use razy_core_kinds, only: i8, wp
   use razy_integrate_field, only: field_t
   use razy_integrate_folded_stages, only: phases, stages
   use razy_integrate_stage_sums, only: add_up, multiply, width
   use razy_integrate_step_strip, only: step_strip_t
   use razy_integrate_tableaux, only: tableau_t
   implicit none(type, external)
   private

   public :: below_on_ladder, half_rung, log_half_rung, near_on_ladder, step_maps_t

   !> Steps of the ladder in a factor of two, modes that are remembered, and steps of each.
   integer, parameter :: rungs = 8, most_modes = 64, most_steps = 32
   !> Bits of the fraction of a number, and of 2**(i/rungs), i = 0 … rungs - 1: those of numbers on the ladder.
   integer, parameter :: fraction_bits = 52
   integer(i8), parameter :: on_ladder(0:rungs - 1) = ibits(transfer([1.0_wp, 1.0905077326652576592_wp, &
                                                                      1.1892071150027210667_wp, 1.2968395546510096659_wp, &
                                                                      1.4142135623730950488_wp, 1.5422108254079408236_wp, &
                                                                      1.6817928305074290861_wp, 1.8340080864093424635_wp], &
                                                                     0_i8, rungs), 0, fraction_bits)
   !> 2**(1/(2 rungs)), and its logarithm.
   real(wp), parameter :: half_rung = 1.0442737824274138403_wp, log_half_rung = 0.043321698784996581_wp

   !> One step in one mode: how often it has served, and then Δ and E, and D (four rows, columns, blocks of rows), and cosine and
   !> sine of the angles of excitation in the step (tones each).
   type :: step_map_t
      real(wp) :: h = 0.0_wp
      integer :: uses = 0
      logical :: made = .false.
      real(wp), allocatable :: ends(:, :, :), dense(:, :, :), cosine(:), sine(:)
   end type step_map_t

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

   !> The step of the ladder nearest to h > 0.
   pure function near_on_ladder(h) result(near)
      real(wp), intent(in) :: h
      real(wp) :: near

      near = below_on_ladder(h*half_rung)
   end function near_on_ladder

   !> The largest step of the ladder that is not longer than h > 0.
   pure function below_on_ladder(h) result(lower)
      real(wp), intent(in) :: h
      real(wp) :: lower

      integer(i8) :: bits, part
      integer :: i

      bits = transfer(h, bits)
      part = ibits(bits, 0, fraction_bits)
      do i = rungs - 1, 1, -1
         if (on_ladder(i) <= part) exit
      end do
      lower = transfer(bits - part + on_ladder(i), lower)
   end function below_on_ladder

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
      self%slot = slot_of(h)
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
         call make(map, field, tableau, columns)
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

   !> Where a step of the ladder is kept; -1 if it is none.
   pure function slot_of(h) result(slot)
      real(wp), intent(in) :: h
      integer :: slot

      integer(i8) :: bits, part
      integer :: i

      bits = transfer(h, bits)
      part = ibits(bits, 0, fraction_bits)
      slot = -1
      do i = 0, rungs - 1
         if (part /= on_ladder(i)) cycle
         slot = int(modulo(shiftr(bits, fraction_bits)*rungs + i, int(most_steps, i8)))
         return
      end do
   end function slot_of

   !> Form a map, column by column.
   subroutine make(map, field, tableau, columns)
      type(step_map_t), intent(inout) :: map
      type(field_t), intent(in) :: field
      type(tableau_t), intent(in) :: tableau
      integer, intent(in) :: columns

      real(wp), dimension(4*((2*field%m + 3)/4)) :: z0, z, sum
      real(wp) :: k(size(z0), tableau%stages + 1 + tableau%extra), part(field%m, size(k, 2))
      real(wp) :: ends(width*blocks(2*field%m*(1 + tableau%errors))), dense(width*blocks(2*field%m*tableau%polynomials))
      integer :: column, e, m, n

      m = field%m
      n = 2*m
      map%made = .true.
      if (allocated(map%ends)) deallocate (map%ends, map%dense, map%cosine, map%sine)
      allocate (map%cosine(size(field%omega)), map%sine(size(field%omega)))
      allocate (map%ends(width, columns, size(ends)/width), map%dense(width, columns, size(dense)/width))
      ends = 0.0_wp
      dense = 0.0_wp
      do column = 1, columns
         z0 = 0.0_wp
         k = 0.0_wp
         part = 0.0_wp
         if (column <= n) k(column, 1) = 1.0_wp
         if (column <= m) then
            ! The velocity goes on as it was, and what it does to the acceleration at the start is in that already.
            z0(m + column) = 1.0_wp
            part = spread(field%matrix(:, m + column), 2, size(k, 2))
         else if (column <= n) then
            part(column - m, :) = 1.0_wp
         else
            call force_of_phase(map, field, tableau, column - n, part)
         end if
         call stages(m, size(z0), tableau, map%h, 2, size(k, 2), field%matrix, part, z0, k, z)
         call add_up(k, tableau%row(tableau%stages + 1), sum)
         ends(:n) = map%h*sum(:n)
         do e = 1, tableau%errors
            call add_up(k, tableau%error(e), sum)
            ends(n*e + 1:n*e + n) = map%h*sum(:n)
         end do
         do e = 1, tableau%polynomials
            call add_up(k, tableau%dense(e), sum)
            dense(n*(e - 1) + 1:n*e) = map%h*sum(:n)
         end do
         map%ends(:, column, :) = reshape(ends, [width, size(map%ends, 3)])
         map%dense(:, column, :) = reshape(dense, [width, size(map%dense, 3)])
      end do
   end subroutine make

   !> How the forcing of all stages differs from that at the start (m, stages), where all phases at the start are 0 but number i
   !> of all cosines and then all sines, which is 1.
   subroutine force_of_phase(map, field, tableau, i, part)
      type(step_map_t), intent(inout) :: map
      type(field_t), intent(in) :: field
      type(tableau_t), intent(in) :: tableau
      integer, intent(in) :: i
      real(wp), intent(out) :: part(:, :)

      real(wp) :: c(size(part, 2)), d(size(part, 2)), start(2)
      integer :: j, last, t

      last = tableau%stages + 1
      t = modulo(i - 1, size(field%omega)) + 1
      start = merge([1.0_wp, 0.0_wp], [0.0_wp, 1.0_wp], i == t)
      call phases(field%omega(t), tableau%node(:last)*map%h, start(1), start(2), c(:last), d(:last))
      call phases(field%omega(t), tableau%node(last + 1:size(c))*map%h, start(1), start(2), c(last + 1:), d(last + 1:))
      do j = 1, size(c)
         part(:, j) = field%on_cosine(:, t)*(c(j) - start(1)) + field%on_sine(:, t)*(d(j) - start(2))
      end do
      if (i /= t) return
      map%cosine(t) = c(last)
      map%sine(t) = d(last)
   end subroutine force_of_phase

   !> Blocks of four that n rows need.
   pure function blocks(n)
      integer, intent(in) :: n
      integer :: blocks

      blocks = (n + width - 1)/width
   end function blocks

end module razy_integrate_step_maps
